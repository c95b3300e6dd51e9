"""Shell completion for bash, zsh and fish: options, commands, choices, and files where a value is one."""

import re

from .programs import Option, Program

MADE = "# Made by tools/manual from what the program says of itself."


def bash(program: Program) -> str:
    """A script that bash-completion loads by the program's name."""
    function = "_" + re.sub(r"\W", "_", program.name)
    steps = [one for command in program.commands for one in command.walk()]
    walks = f'        {"|".join(_quoted(one.name) for one in steps)}) path="$path $word" ;;\n' if steps else ""
    values = "".join(
        f"    {_quoted(f'{one.name} {option.name}')}) {_bash_value(option)} return ;;\n"
        for one in program.walk()
        for option in one.options
        if option.value
    )
    words = "".join(f"    {_quoted(one.name)}) words={_quoted(' '.join(_words(one)))} ;;\n" for one in program.walk())
    walk = f"""    for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
        case "$path $word" in
{walks}        esac
    done
""" if steps else ""  # fmt: skip
    return f"""{MADE}
{function}()
{{
    local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD-1]}} path={program.name} word words
{walk}    case "$path $previous" in
{values}    esac
    case "$path" in
{words}    esac
    COMPREPLY=($(compgen -W "$words" -- "$current"))
    [[ ${{#COMPREPLY[@]}} -gt 0 ]] || COMPREPLY=($(compgen -f -- "$current"))
}}
complete -o filenames -F {function} {program.name}
"""


def _bash_value(option: Option) -> str:
    if option.choices:
        return f'COMPREPLY=($(compgen -W {_quoted(" ".join(option.choices))} -- "$current"));'
    return 'COMPREPLY=($(compgen -f -- "$current"));' if option.is_place else "COMPREPLY=();"


def _words(program: Program) -> list[str]:
    """What may stand after the program or command."""
    names = [one.name.split()[-1] for one in program.commands]
    choices = [word for option in program.options if option.name[0] != "-" for word in option.choices]
    return names + choices + [option.name for option in program.options if option.name[0] == "-"]


def zsh(program: Program) -> str:
    """A script for zsh's $fpath, named _PROGRAM."""
    functions = "\n".join(_zsh_function(one) for one in program.walk())
    return f'#compdef {program.name}\n{MADE}\n\n{functions}\n{_zsh_name(program)} "$@"\n'


def _zsh_name(program: Program) -> str:
    return "_" + re.sub(r"\W", "_", program.name)


def _zsh_function(program: Program) -> str:
    lines = [_zsh_option(option) for option in program.options if option.name[0] == "-"]
    if not program.commands:
        lines += [_zsh_positional(option) for option in program.options if option.name[0] != "-"] or ["'*:file:_files'"]
        body = " \\\n        ".join(["    _arguments", *lines])
        return f"{_zsh_name(program)}()\n{{\n{body}\n}}\n"
    names = "\n".join(f"        {_quoted(one.name.split()[-1] + ':' + one.summary)}" for one in program.commands)
    cases = "\n".join(f"        {one.name.split()[-1]}) {_zsh_name(one)} ;;" for one in program.commands)
    body = " \\\n        ".join(["    _arguments -C", *lines, "'1: :->command'", "'*:: :->rest'"])
    return f"""{_zsh_name(program)}()
{{
    local state line
    local -a commands=(
{names}
    )
{body}
    case $state in
    command) _describe command commands ;;
    rest)
        case $line[1] in
{cases}
        esac ;;
    esac
}}
"""


def _zsh_text(text: str) -> str:
    """Text within brackets or between colons of _arguments."""
    return re.sub(r"([\[\]:\\])", r"\\\1", text)


def _zsh_value(option: Option) -> str:
    action = f"({' '.join(option.choices)})" if option.choices else "_files" if option.is_place else " "
    return f":{_zsh_text(option.value or option.name)}:{action}"


def _zsh_option(option: Option) -> str:
    return _quoted(f"{option.name}[{_zsh_text(option.text)}]{_zsh_value(option) if option.value else ''}")


def _zsh_positional(option: Option) -> str:
    return _quoted(f"*{_zsh_value(option)}")


def fish(program: Program) -> str:
    """A script for fish's completions, named PROGRAM.fish."""
    return f"{MADE}\n" + "".join(
        f"complete -c {program.name}{_fish_condition(program, one)} {line}\n"
        for one in program.walk()
        for line in [*map(_fish_option, (o for o in one.options if o.name[0] == "-")), *_fish_commands(one)]
    )


def _fish_condition(program: Program, one: Program) -> str:
    """Where a line holds: after the words of the command, and before those of any below it."""
    words = one.name.split()[1:]
    seen = [f"__fish_seen_subcommand_from {word}" for word in words]
    below = " ".join(command.name.split()[-1] for command in one.commands)
    seen += [f"not __fish_seen_subcommand_from {below}"] if below else []
    return f" -n {_quoted('; and '.join(seen))}" if seen else ""


def _fish_option(option: Option) -> str:
    kind = "l" if option.name.startswith("--") else "s"
    value = "" if not option.value else " -r" if option.is_place else " -x"
    value += f" -a {_quoted(' '.join(option.choices))}" if option.choices else ""
    return f"-{kind} {option.name.lstrip('-')} -d {_quoted(option.text)}{value}"


def _fish_commands(program: Program) -> list[str]:
    return [f"-f -a {one.name.split()[-1]} -d {_quoted(one.summary)}" for one in program.commands]


def _quoted(text: str) -> str:
    """One word of a shell."""
    return "'" + text.replace("'", "'\\''") + "'"
