#include "record/file_lock.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <unistd.h>

#include <sys/stat.h>

namespace sinerig::record {

namespace {

// SQLite locks bytes at 2^30.
constexpr off_t locked_byte = off_t{1} << 60;

// 0, or why not.
int lock(int descriptor) {
  struct flock byte {};
  byte.l_type = F_WRLCK;
  byte.l_whence = SEEK_SET;
  byte.l_start = locked_byte;
  byte.l_len = 1;
  return fcntl(descriptor, F_OFD_SETLK, &byte) == 0 ? 0 : errno;
}

bool somebody_has_it(int error) {
  return error == EAGAIN || error == EACCES;
}

// Whoever waited for the lock may hold that of a file that has been renamed or removed meanwhile.
bool stands_under(const std::string& path, int descriptor) {
  struct stat opened {};
  struct stat named {};
  return fstat(descriptor, &opened) == 0 && stat(path.c_str(), &named) == 0 &&
         opened.st_dev == named.st_dev && opened.st_ino == named.st_ino;
}

}  // namespace

FileLock::FileLock(const std::string& path, const std::string& who)
    : descriptor_{open(path.c_str(), O_RDWR | O_CLOEXEC)} {
  if (descriptor_ < 0) {
    throw SweepFileError(path + ": cannot be written: " + std::strerror(errno));
  }
  const int error = lock(descriptor_);
  if (error == 0 && stands_under(path, descriptor_)) return;
  close(descriptor_);
  if (error == 0 || somebody_has_it(error)) throw FileInUse(path + ": " + who);
  throw SweepFileError(path + ": cannot be locked: " + std::strerror(error));
}

bool FileLock::displaced(const std::string& path) const noexcept {
  struct stat named {};
  if (stat(path.c_str(), &named) != 0) return errno == ENOENT || errno == ENOTDIR;
  return !stands_under(path, descriptor_);
}

FileLock::~FileLock() {
  close(descriptor_);
}

std::unique_ptr<FileLock> FileLock::claim(const std::string& path) {
  const int descriptor = open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (descriptor < 0) {
    if (errno == EEXIST) return nullptr;
    throw SweepFileError(path + ": cannot be created: " + std::strerror(errno));
  }
  std::unique_ptr<FileLock> claimed{new FileLock{descriptor}};
  const int error = lock(descriptor);
  if (error == 0 && stands_under(path, descriptor)) return claimed;
  if (error == 0 || somebody_has_it(error)) return nullptr;
  unlink(path.c_str());
  throw SweepFileError(path + ": cannot be locked: " + std::strerror(error));
}

}  // namespace sinerig::record
