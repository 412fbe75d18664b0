#include "record/spare_room.h"

#include <cstring>
#include <fcntl.h>
#include <unistd.h>

#include "record/database.h"

namespace sinerig::record {

SpareRoom::SpareRoom(const std::string& sweep_file) : path_{sweep_file + "-spare"} {
  const int file = open(path_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  if (file < 0) throw SweepFileError(path_ + ": cannot be created: " + std::strerror(errno));
  const int error = posix_fallocate(file, 0, bytes);
  close(file);
  if (error == 0) return;
  give_back();
  throw SweepFileError(sweep_file + ": no room for a run: " + std::strerror(error));
}

SpareRoom::~SpareRoom() {
  give_back();
}

void SpareRoom::give_back() noexcept {
  unlink(path_.c_str());
}

}  // namespace sinerig::record
