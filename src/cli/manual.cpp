#include <ostream>
#include <sstream>

#include "cli/completion.h"
#include "version.h"

namespace sinerig::cli {

namespace {

// Text that roff takes as it stands: no command at the start of a line, no escape, hyphens that can
// be copied.
std::string roff(const std::string& text) {
  std::string result;
  bool line_start = true;
  for (const char letter : text) {
    if (line_start && (letter == '.' || letter == '\'')) result += "\\&";
    if (letter == '\\') {
      result += "\\e";
    } else if (letter == '-') {
      result += "\\-";
    } else {
      result += letter;
    }
    line_start = letter == '\n';
  }
  return result;
}

// Paragraphs flow; lines that begin with blanks are shown as they are.
void write_text(std::ostream& stream, const std::string& text) {
  std::istringstream lines{text};
  bool shown = false;
  for (std::string line; std::getline(lines, line);) {
    const bool indented = line.rfind("  ", 0) == 0;
    if (indented && !shown) stream << ".PP\n.nf\n";
    if (!indented && shown) stream << ".fi\n";
    shown = indented;
    if (line.empty()) {
      stream << ".PP\n";
    } else {
      stream << roff(line) << '\n';
    }
  }
  if (shown) stream << ".fi\n";
}

std::string value_of(const CLI::Option& option) {
  if (option.get_items_expected_max() == 0 || option.get_type_size_max() == 0) return "";
  const std::string type = option.get_type_name();
  return type.empty() ? "" : " " + type;
}

void write_options(std::ostream& stream, const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    const std::string names =
        option->get_positional() ? option->get_name(true) : option->get_name(false, true);
    stream << ".TP\n\\fB" << roff(names) << "\\fR";
    if (!option->get_positional()) stream << "\\fI" << roff(value_of(*option)) << "\\fR";
    stream << '\n' << roff(option->get_description());
    if (!option->get_default_str().empty() && option->get_default_str() != "\"\"")
      stream << " [" << roff(option->get_default_str()) << ']';
    stream << '\n';
  }
}

std::string synopsis_of(const CLI::App& app) {
  std::string line = app.get_name();
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_positional()) continue;
    std::string name = option->get_name(true);
    if (option->get_items_expected_max() > 1) name += "...";
    line += option->get_required() ? " " + name : " [" + name + "]";
  }
  return line + " [OPTION...]";
}

}  // namespace

void write_manual(std::ostream& stream, const CLI::App& app) {
  const auto every = [](const CLI::App*) {
    return true;
  };
  stream << ".TH SINERIG 1 \"\" \"sinerig " << version << "\" \"User Commands\"\n.SH NAME\n"
         << "sinerig \\- frequency response of gimbals, servos and actuators by stepped sines\n"
         << ".SH SYNOPSIS\n";
  for (const CLI::App* command : app.get_subcommands(every))
    stream << ".B sinerig " << roff(synopsis_of(*command)) << "\n.br\n";
  stream << ".SH DESCRIPTION\n";
  write_text(stream, app.get_description());
  stream << ".SH OPTIONS\n";
  write_options(stream, app);
  stream << ".SH COMMANDS\n";
  for (const CLI::App* command : app.get_subcommands(every)) {
    stream << ".SS \"" << roff(synopsis_of(*command)) << "\"\n";
    write_text(stream, command->get_description());
    write_options(stream, *command);
  }
  stream << ".SH EXIT STATUS\n";
  write_text(stream, app.get_footer());
  stream << ".SH ENVIRONMENT\n.TP\n.B SPDLOG_LEVEL\nas \\fB\\-\\-log\\-level\\fR\n"
         << ".SH SEE ALSO\n/usr/share/doc/sinerig: measuring, identifying, the drivers, files and "
            "rig files that run as they stand.\n";
}

}  // namespace sinerig::cli
