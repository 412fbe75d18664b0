// Runs the built program in a folder of its own, as a user would.
#pragma once

#include <filesystem>
#include <string>

namespace sinerig::test {

struct Finished {
  int exit_code = -1;
  std::string output;  // standard output
  std::string errors;  // standard error
};

// A temporary folder that goes when it goes out of scope; commands run in it.
class Workshop {
 public:
  Workshop();
  ~Workshop();
  Workshop(const Workshop&) = delete;
  Workshop& operator=(const Workshop&) = delete;

  const std::filesystem::path& folder() const { return folder_; }
  std::string read(const std::string& name) const;
  void write(const std::string& name, const std::string& text) const;
  bool has(const std::string& name) const { return std::filesystem::exists(folder_ / name); }

  // A shell command line.
  Finished shell(const std::string& command) const;
  // `sinerig ARGUMENTS…` of this build.
  Finished sinerig(const std::string& arguments) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace sinerig::test
