#include "drivers/gpio/chips.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <unistd.h>

#include <linux/gpio.h>
#include <sys/ioctl.h>

namespace sinerig::gpio {
namespace {

namespace fs = std::filesystem;

class File {
 public:
  explicit File(const std::string& path) : fd_{open(path.c_str(), O_RDWR | O_CLOEXEC)} {}
  ~File() {
    if (fd_ >= 0) close(fd_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  int fd() const { return fd_; }

 private:
  int fd_;
};

template <std::size_t size>
std::string text_of(const char (&characters)[size]) {
  return {characters, strnlen(characters, size)};
}

std::vector<std::string> chip_paths() {
  std::vector<std::string> paths;
  for (const auto& entry : fs::directory_iterator{"/dev"}) {
    if (entry.path().filename().string().starts_with("gpiochip"))
      paths.push_back(entry.path().string());
  }
  std::ranges::sort(paths);
  return paths;
}

std::optional<gpiochip_info> chip_info(const std::string& path) {
  const File file{path};
  gpiochip_info info{};
  if (file.fd() < 0 || ioctl(file.fd(), GPIO_GET_CHIPINFO_IOCTL, &info) != 0) return std::nullopt;
  return info;
}

[[noreturn]] void no_such_chip(const std::string& chip) {
  std::string there;
  for (const std::string& path : chip_paths()) {
    const auto info = chip_info(path);
    there += (there.empty() ? "" : ", ") + fs::path{path}.filename().string();
    if (info) there += " \"" + text_of(info->label) + "\"";
  }
  throw std::runtime_error(chip + ": there is no such GPIO chip; this machine has " +
                           (there.empty() ? "none" : there));
}

// A number of a chip may change from one start to the next; its label does not.
std::string find_chip(const std::string& chip) {
  const std::string path = chip.starts_with('/') ? chip : "/dev/" + chip;
  if (fs::exists(path)) return path;
  std::string found;
  for (const std::string& candidate : chip_paths()) {
    const auto info = chip_info(candidate);
    if (!info || text_of(info->label) != chip) continue;
    if (!found.empty())
      throw std::runtime_error(chip + ": is the label of " + found + " and of " + candidate +
                               "; name one of them");
    found = candidate;
  }
  if (found.empty()) no_such_chip(chip);
  return found;
}

std::optional<gpio_v2_line_info> line_info(int fd, unsigned offset) {
  gpio_v2_line_info info{};
  info.offset = offset;
  if (ioctl(fd, GPIO_V2_GET_LINEINFO_IOCTL, &info) != 0) return std::nullopt;
  return info;
}

unsigned find_line(const std::string& chip, int fd, unsigned lines, const std::string& name) {
  unsigned offset = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), offset);
  const bool digits = error == std::errc{} && end == name.data() + name.size();
  if (digits && offset < lines) return offset;
  for (unsigned n = 0; !digits && n < lines; ++n) {
    const auto info = line_info(fd, n);
    if (info && text_of(info->name) == name) return n;
  }
  throw std::runtime_error(chip + ": has no line " + (digits ? name : "named \"" + name + "\"") +
                           "; it has " + std::to_string(lines) + ", from 0 to " +
                           std::to_string(lines - 1) + ": `gpioinfo` lists them with their names");
}

}  // namespace

Place locate(const LineRequest& request) {
  Place place;
  place.path = find_chip(request.chip);
  const File file{place.path};
  gpiochip_info info{};
  if (file.fd() < 0 || ioctl(file.fd(), GPIO_GET_CHIPINFO_IOCTL, &info) != 0)
    refuse(request, place, errno);
  for (std::size_t n = 0; n < request.lines.size(); ++n) {
    const Line& line = request.lines[n];
    place.offsets.push_back(find_line(request.chip, file.fd(), info.lines, line.name));
    if (std::ranges::count(place.offsets, place.offsets.back()) > 1)
      throw std::runtime_error(request.chip + ": line " + line.name + " is wanted twice");
    if (line.active_low) place.inverted |= 1U << n;
  }
  return place;
}

void refuse(const LineRequest& request, const Place& place, int error) {
  std::string what = request.chip;
  for (const Line& line : request.lines)
    what += (&line == &request.lines.front() ? " line " : ", ") + line.name;
  what += ": " + std::string{std::strerror(error)};
  if (error == EACCES || error == EPERM)
    what += "; may you open " + place.path + "? (group \"gpio\" on most boards, or a udev rule)";
  if (error == ENODEV || error == ENXIO) what += "; the chip raises no interrupts for these lines";
  if (error == EBUSY) {
    const File file{place.path};
    for (std::size_t n = 0; n < place.offsets.size(); ++n) {
      const auto info = line_info(file.fd(), place.offsets[n]);
      if (!info || (info->flags & GPIO_V2_LINE_FLAG_USED) == 0) continue;
      const std::string user = text_of(info->consumer);
      what += "; line " + request.lines[n].name + " is used by " +
              (user.empty() ? "the kernel" : "\"" + user + "\"");
    }
  }
  throw std::runtime_error(what);
}

}  // namespace sinerig::gpio
