// A file that stands under its name only when it is whole.
#pragma once

#include <string>

namespace sinerig::record {

// PATH.part beside the file, to be written by whatever writes it. Until take_its_place() what
// stands under PATH stays as it is; without it the part is gone with this object.
class PartFile {
 public:
  // Throws SweepFileError where PATH is something that no file can stand in for: a folder, a
  // device.
  explicit PartFile(const std::string& path);
  ~PartFile();
  PartFile(const PartFile&) = delete;
  PartFile& operator=(const PartFile&) = delete;

  const std::string& path() const { return part_; }

  // Puts the part on the disk, then under its name. Throws SweepFileError.
  void take_its_place();

 private:
  std::string target_;  // behind all links
  std::string part_;
};

}  // namespace sinerig::record
