// What the argument tree knows, for shells and for man: nothing is written down twice.
#pragma once

#include <iosfwd>
#include <string>

#include <CLI/CLI.hpp>

namespace sinerig::cli {

// A completion script for bash, zsh or fish: commands, options, the values of options that have a
// fixed set, files by the extension that the command takes. Throws std::invalid_argument for
// another shell.
void write_completion(std::ostream& stream, const CLI::App& app, const std::string& shell);

// The manual page sinerig(1) in roff: the texts of --help, of the program and of every command.
void write_manual(std::ostream& stream, const CLI::App& app);

}  // namespace sinerig::cli
