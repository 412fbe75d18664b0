#include "record/file_lock.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <unistd.h>

namespace sinerig::record {

namespace {

// SQLite locks bytes at 2^30.
constexpr off_t locked_byte = off_t{1} << 60;

}  // namespace

FileLock::FileLock(const std::string& path, const std::string& who)
    : descriptor_{open(path.c_str(), O_RDWR | O_CLOEXEC)} {
  if (descriptor_ < 0) {
    throw SweepFileError(path + ": cannot be written: " + std::strerror(errno));
  }
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  lock.l_start = locked_byte;
  lock.l_len = 1;
  if (fcntl(descriptor_, F_OFD_SETLK, &lock) == 0) return;
  const int error = errno;
  close(descriptor_);
  if (error == EAGAIN || error == EACCES) throw FileInUse(path + ": " + who);
  throw SweepFileError(path + ": cannot be locked: " + std::strerror(error));
}

FileLock::~FileLock() {
  close(descriptor_);
}

}  // namespace sinerig::record
