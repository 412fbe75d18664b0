#include "support/typed_shell.h"

#include <array>
#include <csignal>
#include <cstdlib>
#include <poll.h>
#include <pty.h>
#include <stdexcept>
#include <unistd.h>

#include <sys/wait.h>

namespace sinerig::test {

namespace {

// For one answer; a machine under load starts a shell in some seconds.
constexpr int answer_timeout_ms = 60'000;

// Marks that the echo of what is typed does not hold: there they stand as octal escapes.
constexpr const char* answer_begins = "\001";
constexpr const char* answer_ends = "\002";

}  // namespace

TypedShell::TypedShell(std::vector<std::string> command, const std::filesystem::path& folder) {
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (std::string& each : command) arguments.push_back(each.data());
  arguments.push_back(nullptr);
  winsize size{.ws_row = 50, .ws_col = 1000, .ws_xpixel = 0, .ws_ypixel = 0};
  process_ = forkpty(&terminal_, nullptr, nullptr, &size);
  if (process_ < 0) throw std::runtime_error("no terminal for a shell");
  if (process_ == 0) {
    setenv("HOME", folder.c_str(), 1);
    setenv("TERM", "vt100", 1);
    setenv("PS1", "", 1);
    if (chdir(folder.c_str()) == 0) execvp(arguments[0], arguments.data());
    _exit(127);
  }
  run("sinerig() { printf '\\001'; printf '|%s' \"$@\"; printf '\\002'; }");
}

TypedShell::~TypedShell() {
  kill(process_, SIGKILL);
  waitpid(process_, nullptr, 0);
  close(terminal_);
}

void TypedShell::type(const std::string& keys) const {
  if (write(terminal_, keys.data(), keys.size()) != static_cast<ssize_t>(keys.size()))
    throw std::runtime_error("the shell takes no keys");
}

std::string TypedShell::read_until(const std::string& mark) {
  while (true) {
    const std::size_t end = received_.find(mark);
    if (end != std::string::npos) {
      std::string before = received_.substr(0, end);
      received_.erase(0, end + mark.size());
      return before;
    }
    pollfd readable{.fd = terminal_, .events = POLLIN, .revents = 0};
    if (poll(&readable, 1, answer_timeout_ms) <= 0) return {};
    std::array<char, 4096> chunk{};
    const ssize_t count = read(terminal_, chunk.data(), chunk.size());
    if (count <= 0) return {};
    received_.append(chunk.data(), static_cast<std::size_t>(count));
  }
}

void TypedShell::run(const std::string& line) {
  const std::string number = std::to_string(++lines_);
  type(line + "; printf '\\003" + number + "\\003'\n");
  read_until("\003" + number + "\003");
}

std::string TypedShell::arguments_after(const std::string& keys) {
  type(keys + "\n");
  read_until(answer_begins);
  return read_until(answer_ends);
}

}  // namespace sinerig::test
