// A shell at a terminal of its own, typed at as a person would: its line editor completes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <sys/types.h>

namespace sinerig::test {

class TypedShell {
 public:
  // Starts `command` in `folder` with an empty home there. Throws std::runtime_error where there is
  // no terminal to be had.
  TypedShell(std::vector<std::string> command, const std::filesystem::path& folder);
  ~TypedShell();
  TypedShell(const TypedShell&) = delete;
  TypedShell& operator=(const TypedShell&) = delete;

  // A line of set-up; waits until the shell has done it.
  void run(const std::string& line);

  // Types `keys` and a return, where the command is `sinerig`: the arguments that it would have
  // been called with, each behind a bar: "|run|gimbal.toml". Empty where no answer comes within a
  // minute.
  std::string arguments_after(const std::string& keys);

 private:
  std::string read_until(const std::string& mark);
  void type(const std::string& keys) const;

  int terminal_ = -1;
  pid_t process_ = -1;
  std::string received_;
  int lines_ = 0;
};

}  // namespace sinerig::test
