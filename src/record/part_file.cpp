#include "record/part_file.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <unistd.h>

#include "record/database.h"

namespace sinerig::record {

namespace {

namespace fs = std::filesystem;

// What a link leads to is written, not the link replaced.
std::string behind_links(const std::string& path) {
  std::error_code error;
  if (!fs::exists(path, error)) return path;
  if (!fs::is_regular_file(path, error))
    throw SweepFileError(path + ": cannot be written: it is not a plain file");
  const fs::path target = fs::canonical(path, error);
  return error ? path : target.string();
}

// 0, or why the bytes are not on the disk.
int put_on_disk(const std::string& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return errno;
  const int failed = fsync(file) == 0 ? 0 : errno;
  close(file);
  return failed;
}

}  // namespace

PartFile::PartFile(const std::string& path)
    : target_{behind_links(path)}, part_{target_ + ".part"} {}

PartFile::~PartFile() {
  unlink(part_.c_str());
}

void PartFile::take_its_place() {
  int failed = put_on_disk(part_);
  std::error_code none_before;
  const fs::perms permissions = fs::status(target_, none_before).permissions();
  if (fs::exists(target_, none_before)) fs::permissions(part_, permissions, none_before);
  if (failed == 0 && std::rename(part_.c_str(), target_.c_str()) != 0) failed = errno;
  if (failed != 0) throw SweepFileError(target_ + ": cannot be written: " + std::strerror(failed));
}

}  // namespace sinerig::record
