"""Completion for bash, zsh and fish: the script for each shell, and the candidates it asks for.

The scripts of click 8.5 fail on our values: in bash, words end at ``:`` and ``=``; in zsh,
``--device=fa`` loses its ``--device=``, and a blank follows ``front=`` and ``serial:``; in fish, nothing is
completed after ``--device=`` or after a comma.
"""

import os
import sys
from contextlib import redirect_stderr
from typing import TYPE_CHECKING, Any, ClassVar, Final

from click.shell_completion import BashComplete, FishComplete, ShellComplete, ZshComplete, split_arg_string

from sphero_probe.cli import COMPLETE_VARIABLE, NAME
from sphero_probe.cli.group import group

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

_BASH: Final = """\
%(complete_func)s() {
    local IFS=$'\\n' kind value files=
    COMPREPLY=()
    while IFS=, read -r kind value; do
        case $kind in
            plain) COMPREPLY+=("$value") ;;
            file) files=yes ;;
        esac
    done < <(COMP_WORDS="${COMP_LINE:0:COMP_POINT}" COMP_CWORD="$2" \\
        %(complete_var)s=bash_complete "$1" 2>/dev/null)
    if [[ $files && ${#COMPREPLY[@]} -eq 0 ]]; then
        compopt -o bashdefault -o default 2>/dev/null
    elif [[ $files ]]; then
        compopt -o filenames 2>/dev/null
        while read -r value; do
            COMPREPLY+=("$value")
        done < <(compgen -f -- "$2")
    fi
    if [[ ${#COMPREPLY[@]} -eq 1 && ${COMPREPLY[0]} == *[:=] ]]; then
        compopt -o nospace 2>/dev/null
    fi
}
complete -o nosort -F %(complete_func)s %(prog_name)s 2>/dev/null ||
    complete -F %(complete_func)s %(prog_name)s
"""
_ZSH: Final = """\
#compdef %(prog_name)s
%(complete_func)s() {
    local kind value about
    local -a told bare open
    [[ $PREFIX == -*=* ]] && compset -P 1 '*='
    for kind value about in "${(@f)$(COMP_WORDS="${words[*]}" COMP_CWORD=$((CURRENT - 1)) \\
            %(complete_var)s=zsh_complete ${~words[1]} 2>/dev/null)}"; do
        case $kind:$value:$about in
            file:*) _files ;;
            plain:*[=:]:_) open+=("$value") ;;
            plain:*:_) bare+=("$value") ;;
            plain:*) told+=("$value:$about") ;;
        esac
    done
    (( $#told )) && _describe -V offers told
    (( $#bare )) && compadd -V bare -a bare
    (( $#open )) && compadd -V open -S '' -a open
}
if [[ $zsh_eval_context[-1] == loadautofunc ]]; then
    %(complete_func)s "$@"
else
    compdef %(complete_func)s %(prog_name)s
fi
"""
_FISH: Final = """\
function %(complete_func)s
    set -l line (commandline -cp)
    set -l word (commandline -ct)
    for offer in (env COMP_WORDS="$line" COMP_CWORD="$word" %(complete_var)s=fish_complete \\
            %(prog_name)s 2>/dev/null)
        set -l parts (string split -m 1 , -- $offer)
        switch $parts[1]
            case file
                __fish_complete_path $parts[2]
            case plain
                echo $parts[2]
        end
    end
end
complete --no-files --keep-order --command %(prog_name)s --arguments '(%(complete_func)s)'
"""


class Bash(BashComplete):
    """Bash, where words end at ``:`` and ``=``: a candidate is only what follows them.

    The script passes the line up to the cursor, and the word as bash sees it.
    """

    source_template: ClassVar[str] = _BASH

    def source(self) -> str:
        """Return the script, without starting another bash to ask for its version."""
        return ShellComplete.source(self)

    def get_completion_args(self) -> tuple[list[str], str]:
        """Split the line as a shell does."""
        line = os.environ["COMP_WORDS"]
        words = split_arg_string(line)[1:]
        begun = words.pop() if words and split_arg_string(line + "x")[1:] != [*words, "x"] else ""
        return words, begun

    def get_completions(self, args: list[str], incomplete: str) -> "list[CompletionItem[Any]]":
        """Remove from the candidates what bash has before its word, or add it."""
        offers = super().get_completions(args, incomplete)
        option, equals, value = incomplete.partition("=")
        begun = value if equals and option.startswith("-") else incomplete
        seen = os.environ["COMP_CWORD"]
        before = begun[: len(begun) - len(seen)] if begun.endswith(seen) else ""
        missing = seen[: len(seen) - len(begun)] if seen.endswith(begun) else ""
        for offer in offers:
            offer.value = missing + offer.value.removeprefix(before)
        return offers


class Zsh(ZshComplete):
    """Zsh: an option before ``=`` stays, and no blank follows what ends in ``:`` or ``=``."""

    source_template: ClassVar[str] = _ZSH


class Fish(FishComplete):
    """Fish, which replaces the whole word, ``--option=`` included."""

    source_template: ClassVar[str] = _FISH

    def get_completions(self, args: list[str], incomplete: str) -> "list[CompletionItem[Any]]":
        """Put ``--option=`` in front of its values; the script handles commas."""
        offers = super().get_completions(args, incomplete)
        option, equals, _ = incomplete.partition("=")
        if equals and option.startswith("-"):
            for offer in offers:
                offer.value = f"{option}={offer.value}"
        return offers


SHELLS: Final[dict[str, type[ShellComplete]]] = {"bash": Bash, "zsh": Zsh, "fish": Fish}


def script(shell: str) -> str:
    """Return the script for one of ``SHELLS``."""
    return SHELLS[shell](group, {}, NAME, COMPLETE_VARIABLE).source()


def answer() -> int:
    """Answer a script; errors are not printed, because they would disturb the prompt.

    Returns:
        The exit code: 0, or 1 without an answer.
    """
    shell, _, what = os.environ[COMPLETE_VARIABLE].partition("_")
    with open(os.devnull, "w", encoding="utf-8") as nowhere, redirect_stderr(nowhere):  # noqa: PTH123 - quick
        try:
            said = script(shell) if what == "source" else _offers(shell)
            sys.stdout.buffer.write(said.encode())
            sys.stdout.flush()
        except BaseException:  # noqa: BLE001 - an error would disturb the prompt
            return 1
    return 0


def _offers(shell: str) -> str:
    return SHELLS[shell](group, {}, NAME, COMPLETE_VARIABLE).complete() + "\n"
