"""What the answers of an evidence run say about the open questions: one pure function for each.

A function claims no more than the answers prove. Where they do not suffice, it says what is missing.
"""
