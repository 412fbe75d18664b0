#include "cli/completion.h"

#include <ostream>
#include <stdexcept>
#include <vector>

namespace sinerig::cli {

namespace {

struct CompletedOption {
  std::vector<std::string> names;   // "--output", "-o"
  std::string description;          // one line
  std::vector<std::string> values;  // those that it takes; empty: any, or none
  bool takes_value = false;
};

struct CompletedCommand {
  std::string name;
  std::string description;
  std::string files;  // extensions that its positional takes, separated by |; empty: none
  std::vector<std::string> words;  // that its positional takes
  std::vector<CompletedOption> options;
};

std::vector<std::string> split(const std::string& text, char mark) {
  std::vector<std::string> parts;
  std::size_t from = 0;
  while (from <= text.size()) {
    const std::size_t end = std::min(text.find(mark, from), text.size());
    if (end > from) parts.push_back(text.substr(from, end - from));
    from = end + 1;
  }
  return parts;
}

// CLI11 keeps the members of IsMember in the type's text only: "TEXT:{csv,json}".
std::vector<std::string> values_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t open = type.find('{');
  const std::size_t close = type.rfind('}');
  if (open == std::string::npos || close < open) return {};
  return split(type.substr(open + 1, close - open - 1), ',');
}

std::vector<CompletedOption> options_of(const CLI::App& app) {
  std::vector<CompletedOption> options;
  for (const CLI::Option* option : app.get_options()) {
    CompletedOption each;
    for (const std::string& name : option->get_snames()) each.names.push_back("-" + name);
    for (const std::string& name : option->get_lnames()) each.names.push_back("--" + name);
    if (each.names.empty()) continue;
    each.description = option->get_description();
    each.values = values_of(*option);
    each.takes_value = option->get_expected_max() > 0 && option->get_items_expected_max() > 0 &&
                       option->get_type_size_max() > 0;
    options.push_back(std::move(each));
  }
  return options;
}

// The first positional of a command, which is all that any has; null where it has none.
const CLI::Option* positional_of(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_positional()) return option;
  }
  return nullptr;
}

std::string files_of(const CLI::Option* positional) {
  if (positional == nullptr || !values_of(*positional).empty()) return "";
  const std::string name = positional->get_name(true);
  return name == "RIG" || name == "JOB" ? "toml" : "sweep|csv|txt|mat|uff|unv";
}

// Those that may stand before and behind the command.
std::vector<CompletedOption> global_options(const CLI::App& app) {
  std::vector<CompletedOption> options = options_of(app);
  std::erase_if(options, [](const CompletedOption& option) {
    return option.names.back() == "--help" || option.names.back() == "--version";
  });
  return options;
}

std::vector<CompletedCommand> commands_of(const CLI::App& app) {
  std::vector<CompletedCommand> commands;
  for (const CLI::App* each : app.get_subcommands([](const CLI::App*) { return true; })) {
    const CLI::Option* positional = positional_of(*each);
    CompletedCommand command{
        .name = each->get_name(),
        .description = each->get_description(),
        .files = files_of(positional),
        .words = positional == nullptr ? std::vector<std::string>{} : values_of(*positional),
        .options = options_of(*each)};
    for (CompletedOption& option : global_options(app))
      command.options.push_back(std::move(option));
    commands.push_back(std::move(command));
  }
  return commands;
}

std::string joined(const std::vector<std::string>& parts, const std::string& between) {
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : between) + part;
  return text;
}

// For single quotes of a shell; square brackets and colons mean something in zsh's descriptions.
std::string quoted(const std::string& text, bool zsh = false) {
  std::string result;
  for (const char letter : text) {
    if (letter == '\'') {
      result += "'\\''";
    } else if (letter == '\n') {
      result += ' ';
    } else {
      if (zsh && (letter == '[' || letter == ']' || letter == ':')) result += '\\';
      result += letter;
    }
  }
  return result;
}

// What completes the values of options, for `case $before`.
void write_bash_values(std::ostream& stream, const std::vector<CompletedOption>& options) {
  for (const CompletedOption& option : options) {
    if (!option.takes_value) continue;
    stream << "        " << joined(option.names, "|") << ") ";
    if (option.values.empty()) {
      stream << "COMPREPLY=($(compgen -f -- \"$word\")); return ;;\n";
    } else {
      stream << "COMPREPLY=($(compgen -W '" << joined(option.values, " ")
             << "' -- \"$word\")); return ;;\n";
    }
  }
}

std::vector<std::string> names_of(const std::vector<CompletedOption>& options,
                                  bool with_value_only) {
  std::vector<std::string> names;
  for (const CompletedOption& option : options) {
    if (option.takes_value || !with_value_only)
      names.insert(names.end(), option.names.begin(), option.names.end());
  }
  return names;
}

void write_bash(std::ostream& stream, const std::vector<CompletedCommand>& commands,
                const std::vector<CompletedOption>& globals) {
  std::vector<std::string> names;
  names.reserve(commands.size());
  for (const CompletedCommand& command : commands) names.push_back(command.name);
  stream << "# bash completion for sinerig: sinerig completion bash\n"
            "_sinerig() {\n"
            "  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} command= i\n"
            "  local options= files= words=\n"
            "  COMPREPLY=()\n"
            "  for ((i = 1; i < COMP_CWORD; ++i)); do\n"
            "    case ${COMP_WORDS[i]} in\n";
  // Bash makes --level=debug three words. The value is not the command.
  if (const std::vector<std::string> valued = names_of(globals, true); !valued.empty())
    stream << "      " << joined(valued, "|")
           << ") [[ ${COMP_WORDS[i+1]} != = ]] || ((++i)); ((++i)) ;;\n";
  stream << "      -*) ;;\n"
            "      *) command=${COMP_WORDS[i]}; break ;;\n"
            "    esac\n"
            "  done\n"
            "  case $command in\n"
            "    '')\n      case $before in\n";
  write_bash_values(stream, globals);
  stream << "      esac\n      options='" << joined(names, " ") << ' '
         << joined(names_of(globals, false), " ") << " --help --version' ;;\n";
  for (const CompletedCommand& command : commands) {
    stream << "    " << command.name << ")\n      case $before in\n";
    write_bash_values(stream, command.options);
    stream << "      esac\n      options='" << joined(names_of(command.options, false), " ")
           << "' files='" << command.files << "' words='" << joined(command.words, " ") << "' ;;\n";
  }
  stream << "  esac\n"
            "  if [[ $word == -* || -z $command ]]; then\n"
            "    COMPREPLY=($(compgen -W \"$options\" -- \"$word\"))\n"
            "  elif [ -n \"$words\" ]; then\n"
            "    COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n"
            "  elif [ -n \"$files\" ]; then\n"
            "    local file\n"
            "    while IFS= read -r file; do\n"
            "      if [ -d \"$file\" ]; then\n"
            "        COMPREPLY+=(\"$file/\")\n"
            "      elif [[ ${file##*.} =~ ^($files)$ ]]; then\n"
            "        COMPREPLY+=(\"$file\")\n"
            "      fi\n"
            "    done < <(compgen -f -- \"$word\")\n"
            "    compopt -o filenames 2>/dev/null\n"
            "  fi\n"
            "}\n"
            "complete -F _sinerig sinerig\n";
}

// A single word in brackets at the end of a pattern would be a qualifier.
std::string zsh_pattern(const std::string& extensions) {
  return extensions.find('|') == std::string::npos ? "*." + extensions : "*.(" + extensions + ")";
}

void write_zsh(std::ostream& stream, const std::vector<CompletedCommand>& commands) {
  stream << "#compdef sinerig\n# zsh completion for sinerig: sinerig completion zsh\n"
            "_sinerig() {\n"
            "  local state line\n"
            "  _arguments -C '(- *)--help[print this help]' '(- *)--version[print the version]' "
            "'1: :->command' '*:: :->rest'\n"
            "  case $state in\n"
            "    command)\n      local -a commands=(\n";
  for (const CompletedCommand& command : commands)
    stream << "        '" << command.name << ':' << quoted(command.description, true) << "'\n";
  stream << "      )\n      _describe command commands ;;\n    rest)\n      case $line[1] in\n";
  for (const CompletedCommand& command : commands) {
    stream << "        " << command.name << ")\n          _arguments";
    for (const CompletedOption& option : command.options) {
      const std::string value = !option.takes_value ? ""
                                : option.values.empty()
                                    ? ":value:_files"
                                    : ":value:(" + quoted(joined(option.values, " ")) + ")";
      const std::string text = "[" + quoted(option.description, true) + "]" + value;
      for (const std::string& name : option.names)
        stream << " \\\n            '" << name << text << "'";
    }
    if (!command.files.empty())
      stream << " \\\n            '*:file:_files -g \"" << zsh_pattern(command.files) << "\"'";
    if (!command.words.empty())
      stream << " \\\n            '1:word:(" << quoted(joined(command.words, " ")) << ")'";
    stream << " ;;\n";
  }
  stream
      << "      esac ;;\n  esac\n}\nif [ \"$funcstack[1]\" = _sinerig ]; then\n  _sinerig \"$@\"\n"
         "else\n  compdef _sinerig sinerig\nfi\n";
}

void write_fish(std::ostream& stream, const std::vector<CompletedCommand>& commands) {
  stream << "# fish completion for sinerig: sinerig completion fish\ncomplete -c sinerig -f\n";
  for (const CompletedCommand& command : commands) {
    stream << "complete -c sinerig -n __fish_use_subcommand -a " << command.name << " -d '"
           << quoted(command.description) << "'\n";
    const std::string when =
        "complete -c sinerig -n '__fish_seen_subcommand_from " + command.name + "'";
    if (!command.files.empty())
      stream
          << when
          << " -k -a '(__fish_complete_path (commandline -ct) | string match -r -- \"^.*(?:\\.(?:"
          << command.files << ")|/)(?:\\t.*)?\\$\")'\n";
    if (!command.words.empty())
      stream << when << " -a '" << quoted(joined(command.words, " ")) << "'\n";
    for (const CompletedOption& option : command.options) {
      stream << when;
      for (const std::string& name : option.names)
        stream << (name[1] == '-' ? " -l " + name.substr(2) : " -s " + name.substr(1));
      if (option.takes_value) stream << (option.values.empty() ? " -r -F" : " -x");
      if (!option.values.empty()) stream << " -a '" << quoted(joined(option.values, " ")) << "'";
      stream << " -d '" << quoted(option.description) << "'\n";
    }
  }
}

}  // namespace

void write_completion(std::ostream& stream, const CLI::App& app, const std::string& shell) {
  const std::vector<CompletedCommand> commands = commands_of(app);
  if (shell == "bash") return write_bash(stream, commands, global_options(app));
  if (shell == "zsh") return write_zsh(stream, commands);
  if (shell == "fish") return write_fish(stream, commands);
  throw std::invalid_argument{"no completion for \"" + shell + "\"; there is bash, zsh and fish"};
}

}  // namespace sinerig::cli
