// The other end of gpio-sim's lines: reads what outputs are driven to, drives inputs.
#pragma once

#include <cstdint>
#include <string>

#include <sys/types.h>

namespace sinerig::sim {

// The folder in sysfs of a chip that gpio-sim has made. Throws std::runtime_error.
std::string sim_chip_folder(const std::string& chip);

// A line that a program drives. Its fd() is readable (POLLPRI) when the level has been set.
class DrivenLine {
 public:
  DrivenLine(const std::string& chip_folder, unsigned line);
  ~DrivenLine();
  DrivenLine(const DrivenLine&) = delete;
  DrivenLine& operator=(const DrivenLine&) = delete;

  bool high();
  int fd() const { return fd_; }

 private:
  int fd_;
};

// A line that a program reads.
class PulledLine {
 public:
  PulledLine(const std::string& chip_folder, unsigned line);
  ~PulledLine();
  PulledLine(const PulledLine&) = delete;
  PulledLine& operator=(const PulledLine&) = delete;

  void pull(bool high);

 private:
  int fd_;
};

}  // namespace sinerig::sim
