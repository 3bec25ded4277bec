"""Shell completion: the scripts for each shell, and the candidates they ask for."""
