#include "sim/gpio_axis/sim_lines.h"

#include <cerrno>
#include <fcntl.h>
#include <filesystem>
#include <stdexcept>
#include <unistd.h>

#include <system_error>

namespace sinerig::sim {
namespace {

int open_file(const std::string& path, int flags) {
  const int fd = open(path.c_str(), flags | O_CLOEXEC);
  if (fd < 0) throw std::system_error(errno, std::generic_category(), path);
  return fd;
}

std::string line_file(const std::string& folder, unsigned line, const char* name) {
  return folder + "/sim_gpio" + std::to_string(line) + "/" + name;
}

}  // namespace

std::string sim_chip_folder(const std::string& chip) {
  const std::filesystem::path platform{"/sys/devices/platform"};
  for (const auto& device : std::filesystem::directory_iterator{platform}) {
    const std::filesystem::path folder = device.path() / chip;
    const bool simulated = device.path().filename().string().starts_with("gpio-sim");
    if (simulated && std::filesystem::exists(folder)) return folder.string();
  }
  throw std::runtime_error("there is no simulated chip " + chip + " (gpio-sim)");
}

DrivenLine::DrivenLine(const std::string& chip_folder, unsigned line)
    : fd_{open_file(line_file(chip_folder, line, "value"), O_RDONLY)} {}

DrivenLine::~DrivenLine() {
  close(fd_);
}

bool DrivenLine::high() {
  char level = '0';
  if (pread(fd_, &level, 1, 0) != 1)
    throw std::system_error(errno, std::generic_category(), "a simulated line cannot be read");
  return level == '1';
}

PulledLine::PulledLine(const std::string& chip_folder, unsigned line)
    : fd_{open_file(line_file(chip_folder, line, "pull"), O_WRONLY)} {}

PulledLine::~PulledLine() {
  close(fd_);
}

void PulledLine::pull(bool high) {
  const std::string word = high ? "pull-up" : "pull-down";
  if (pwrite(fd_, word.data(), word.size(), 0) != static_cast<ssize_t>(word.size()))
    throw std::system_error(errno, std::generic_category(), "a simulated line cannot be pulled");
}

}  // namespace sinerig::sim
