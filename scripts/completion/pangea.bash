# Bash completion of Pangea's programs: sub-commands, options and their choices (taken from each
# program's --help), names of sessions, files.
#   source scripts/completion/pangea.bash                  (zsh: autoload -U bashcompinit && bashcompinit, before it)
# `cmake --install` and the packages install this file where bash-completion finds it by itself.

# Prints the sub-commands of a program.
_pangea_commands() {
  "$1" --help 2>/dev/null | sed -n '/^Subcommands:/,$ s/^  \([a-z][a-z0-9-]*\)\( .*\)\?$/\1/p'
}

_pangea() {
  local program=$1 current=$2 previous=$3 commands command="" word help
  commands=$(_pangea_commands "$program")
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    if grep -qxF -e "$word" <<<"$commands"; then
      command=$word
      break
    fi
  done
  help=$("$program" ${command:+"$command"} --help 2>/dev/null)

  # An option's value: its choices, or a file.
  if [[ $previous == --* ]]; then
    local choices
    choices=$(sed -n "s/^  \(-.,\)\?$previous[ ,].*{\([^}]*\)}.*/\2/p" <<<"$help" | tr ',' ' ')
    mapfile -t COMPREPLY < <(compgen -W "$choices" -- "$current")
    return
  fi
  if [[ $current == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$(sed -n 's/^  \(-.,\)\?\(--[a-z][a-z0-9-]*\).*/\2/p' <<<"$help")" -- "$current")
    return
  fi
  if [[ -z $command && -n $commands ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$commands" -- "$current")
  elif [[ $command == run ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$("$program" list --names 2>/dev/null)" -- "$current"
      compgen -f -X '!*.yaml' -- "$current")
  fi
}

complete -o bashdefault -o default -F _pangea pangea-agent-handler pangea-anchors pangea-bridge pangea-calibrate pangea-eval pangea-fusion pangea-gateway pangea-global-ba \
  pangea-inter-map-ba pangea-keyframe-player pangea-link-emulator pangea-log pangea-map-points pangea-place-recognition \
  pangea-posegraph pangea-server pangea-session pangea-sim pangea-site pangea-uplink pangea-viewer pangea-vio
