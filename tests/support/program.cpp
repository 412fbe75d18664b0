#include "support/program.h"

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include <sys/wait.h>

namespace sinerig::test {

namespace fs = std::filesystem;

Workshop::Workshop() {
  std::string name = (fs::temp_directory_path() / "sinerig-test-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
  folder_ = name;
}

Workshop::~Workshop() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

std::string Workshop::read(const std::string& name) const {
  std::ifstream stream{folder_ / name, std::ios::binary};
  return {std::istreambuf_iterator<char>{stream}, {}};
}

void Workshop::write(const std::string& name, const std::string& text) const {
  std::ofstream{folder_ / name, std::ios::binary} << text;
}

Finished Workshop::shell(const std::string& command) const {
  const std::string line =
      "cd '" + folder_.string() + "' && { " + command + "; } >.output 2>.errors </dev/null";
  const int status = std::system(line.c_str());
  return {.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1,
          .output = read(".output"),
          .errors = read(".errors")};
}

Finished Workshop::sinerig(const std::string& arguments) const {
  return shell(std::string{SINERIG_BINARY} + " " + arguments);
}

}  // namespace sinerig::test
