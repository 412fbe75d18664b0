#include "crash/faulty_disk.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <unistd.h>
#include <vector>

#include <sqlite3.h>

#include "record/spare_room.h"

namespace sinerig::test {

namespace {

// A file as the page cache has it, and what of it the disk has not.
struct Cached {
  struct Change {
    sqlite3_int64 offset = 0;
    std::vector<char> data;
    bool truncates = false;
  };
  std::vector<char> image;
  std::vector<Change> unsynced;
};

struct Disk {
  std::mutex mutex;
  std::uint64_t operations = 0;
  std::uint64_t kill_at = 0;   // 0: never
  std::uint64_t fails_at = 0;  // 0: never
  std::chrono::milliseconds sync_time{0};
  std::string hold_file;
  bool power = false;
  bool limited = false;
  std::uint64_t room = 0;
  std::uint64_t grown = 0;
  bool spare_counted = false;
  std::string spare;  // path, once the sweep file is known
  std::string count_file;
  std::map<std::string, std::shared_ptr<Cached>> files;
  sqlite3_vfs* below = nullptr;
};

Disk& disk() {
  static Disk the_disk;
  return the_disk;
}

struct File {
  sqlite3_file base;
  std::shared_ptr<Cached>* cached;
  sqlite3_file* real() { return reinterpret_cast<sqlite3_file*>(this + 1); }
};

File& file_of(sqlite3_file* file) {
  return *reinterpret_cast<File*>(file);
}

bool last_operation() {
  return ++disk().operations == disk().kill_at;
}

bool read_only() {
  return disk().fails_at > 0 && disk().operations >= disk().fails_at;
}

[[noreturn]] void die() {
  raise(SIGKILL);
  std::abort();
}

int apply(sqlite3_file* real, const Cached::Change& change) {
  if (change.truncates) return real->pMethods->xTruncate(real, change.offset);
  return real->pMethods->xWrite(real, change.data.data(), static_cast<int>(change.data.size()),
                                change.offset);
}

int close_file(sqlite3_file* base) {
  File& file = file_of(base);
  delete file.cached;
  return file.real()->pMethods->xClose(file.real());
}

int read_file(sqlite3_file* base, void* to, int size, sqlite3_int64 offset) {
  File& file = file_of(base);
  if (!disk().power) return file.real()->pMethods->xRead(file.real(), to, size, offset);
  const std::scoped_lock lock{disk().mutex};
  const std::vector<char>& image = (*file.cached)->image;
  const auto begin = std::min(static_cast<std::size_t>(offset), image.size());
  const std::size_t there = std::min(image.size() - begin, static_cast<std::size_t>(size));
  std::memcpy(to, image.data() + begin, there);
  std::memset(static_cast<char*>(to) + there, 0, static_cast<std::size_t>(size) - there);
  return there == static_cast<std::size_t>(size) ? SQLITE_OK : SQLITE_IOERR_SHORT_READ;
}

std::uint64_t size_of(File& file) {
  if (disk().power) return (*file.cached)->image.size();
  sqlite3_int64 size = 0;
  file.real()->pMethods->xFileSize(file.real(), &size);
  return static_cast<std::uint64_t>(size);
}

int write_file(sqlite3_file* base, const void* from, int size, sqlite3_int64 offset) {
  File& file = file_of(base);
  Disk& all = disk();
  const std::scoped_lock lock{all.mutex};
  const auto end = static_cast<std::uint64_t>(offset + size);
  const std::uint64_t before = size_of(file);
  const std::uint64_t growth = end > before ? end - before : 0;
  const char* bytes = static_cast<const char*>(from);
  if (last_operation()) {
    // A process dies between its system calls: half of a write is what two of them may leave.
    if (!all.power) file.real()->pMethods->xWrite(file.real(), from, size / 2, offset);
    die();
  }
  if (read_only()) return SQLITE_IOERR_WRITE;
  if (all.limited && all.grown + growth > all.room) {
    if (!all.spare_counted && !all.spare.empty() && access(all.spare.c_str(), F_OK) != 0) {
      all.spare_counted = true;
      all.room += record::SpareRoom::bytes;
    }
    if (all.grown + growth > all.room) {
      if (growth > 1 && before == static_cast<std::uint64_t>(offset)) {
        file.real()->pMethods->xWrite(file.real(), from, size / 2, offset);
        all.grown += static_cast<std::uint64_t>(size) / 2;
      }
      return SQLITE_FULL;
    }
  }
  all.grown += growth;
  if (!all.power) return file.real()->pMethods->xWrite(file.real(), from, size, offset);
  Cached& cached = **file.cached;
  if (end > cached.image.size()) cached.image.resize(end);
  std::copy(bytes, bytes + size, cached.image.begin() + offset);
  cached.unsynced.push_back({.offset = offset, .data = {bytes, bytes + size}});
  return SQLITE_OK;
}

int truncate_file(sqlite3_file* base, sqlite3_int64 size) {
  File& file = file_of(base);
  const std::scoped_lock lock{disk().mutex};
  if (last_operation()) die();
  if (!disk().power) return file.real()->pMethods->xTruncate(file.real(), size);
  (*file.cached)->image.resize(static_cast<std::size_t>(size));
  (*file.cached)->unsynced.push_back({.offset = size, .data = {}, .truncates = true});
  return SQLITE_OK;
}

int sync_file(sqlite3_file* base, int flags) {
  File& file = file_of(base);
  const std::scoped_lock lock{disk().mutex};
  const bool last = last_operation();
  if (disk().power) {
    std::vector<Cached::Change>& unsynced = (*file.cached)->unsynced;
    const std::size_t reached = last ? unsynced.size() / 2 : unsynced.size();
    for (std::size_t i = 0; i < reached; ++i) {
      if (const int code = apply(file.real(), unsynced[i]); code != SQLITE_OK) return code;
    }
    unsynced.clear();
  }
  if (last) die();
  if (read_only()) return SQLITE_IOERR_FSYNC;
  std::this_thread::sleep_for(disk().sync_time);
  while (!disk().hold_file.empty() && access(disk().hold_file.c_str(), F_OK) == 0)
    std::this_thread::sleep_for(std::chrono::milliseconds{5});
  return file.real()->pMethods->xSync(file.real(), flags);
}

int file_size(sqlite3_file* base, sqlite3_int64* size) {
  const std::scoped_lock lock{disk().mutex};
  *size = static_cast<sqlite3_int64>(size_of(file_of(base)));
  return SQLITE_OK;
}

// The rest is the system's.
sqlite3_io_methods methods() {
  sqlite3_io_methods m{};
  m.iVersion = 2;
  m.xClose = close_file;
  m.xRead = read_file;
  m.xWrite = write_file;
  m.xTruncate = truncate_file;
  m.xSync = sync_file;
  m.xFileSize = file_size;
  m.xLock = [](sqlite3_file* f, int level) {
    return file_of(f).real()->pMethods->xLock(file_of(f).real(), level);
  };
  m.xUnlock = [](sqlite3_file* f, int level) {
    return file_of(f).real()->pMethods->xUnlock(file_of(f).real(), level);
  };
  m.xCheckReservedLock = [](sqlite3_file* f, int* out) {
    return file_of(f).real()->pMethods->xCheckReservedLock(file_of(f).real(), out);
  };
  m.xFileControl = [](sqlite3_file* f, int op, void* arg) {
    return file_of(f).real()->pMethods->xFileControl(file_of(f).real(), op, arg);
  };
  m.xSectorSize = [](sqlite3_file* f) {
    return file_of(f).real()->pMethods->xSectorSize(file_of(f).real());
  };
  m.xDeviceCharacteristics = [](sqlite3_file* f) {
    return file_of(f).real()->pMethods->xDeviceCharacteristics(file_of(f).real());
  };
  m.xShmMap = [](sqlite3_file* f, int page, int size, int extend, void volatile** to) {
    return file_of(f).real()->pMethods->xShmMap(file_of(f).real(), page, size, extend, to);
  };
  m.xShmLock = [](sqlite3_file* f, int offset, int n, int flags) {
    return file_of(f).real()->pMethods->xShmLock(file_of(f).real(), offset, n, flags);
  };
  m.xShmBarrier = [](sqlite3_file* f) {
    file_of(f).real()->pMethods->xShmBarrier(file_of(f).real());
  };
  m.xShmUnmap = [](sqlite3_file* f, int remove) {
    return file_of(f).real()->pMethods->xShmUnmap(file_of(f).real(), remove);
  };
  return m;
}

std::shared_ptr<Cached> cached_file(const char* name, sqlite3_file* real) {
  const std::scoped_lock lock{disk().mutex};
  const std::string key = name == nullptr ? "" : name;
  if (!key.empty()) {
    const auto found = disk().files.find(key);
    if (found != disk().files.end()) return found->second;
  }
  auto cached = std::make_shared<Cached>();
  sqlite3_int64 size = 0;
  real->pMethods->xFileSize(real, &size);
  cached->image.resize(static_cast<std::size_t>(size));
  if (size > 0) real->pMethods->xRead(real, cached->image.data(), static_cast<int>(size), 0);
  if (!key.empty()) disk().files[key] = cached;
  return cached;
}

int open_file(sqlite3_vfs*, const char* name, sqlite3_file* base, int flags, int* out_flags) {
  static const sqlite3_io_methods faulty = methods();
  File& file = file_of(base);
  file.base.pMethods = nullptr;
  sqlite3_vfs* below = disk().below;
  const int code = below->xOpen(below, name, file.real(), flags, out_flags);
  if (code != SQLITE_OK) return code;
  if ((flags & SQLITE_OPEN_MAIN_DB) != 0 && name != nullptr) {
    disk().spare = std::string{name} + "-spare";
  }
  file.cached = new std::shared_ptr<Cached>{disk().power ? cached_file(name, file.real())
                                                         : std::shared_ptr<Cached>{}};
  file.base.pMethods = &faulty;
  return SQLITE_OK;
}

int delete_file(sqlite3_vfs*, const char* name, int sync_folder) {
  const std::scoped_lock lock{disk().mutex};
  if (last_operation()) die();
  disk().files.erase(name);
  return disk().below->xDelete(disk().below, name, sync_folder);
}

void write_count() {
  std::ofstream{disk().count_file} << disk().operations << ' ' << disk().grown << '\n';
}

}  // namespace

void install_faulty_disk(const std::string& orders) {
  Disk& all = disk();
  std::istringstream list{orders};
  for (std::string order; std::getline(list, order, ',');) {
    const std::size_t equals = order.find('=');
    const std::string name = order.substr(0, equals);
    const std::string value = equals == std::string::npos ? "" : order.substr(equals + 1);
    if (name == "count") {
      all.count_file = value;
      std::atexit(write_count);
    } else if (name == "kill") {
      all.kill_at = std::stoull(value);
    } else if (name == "fails") {
      all.fails_at = std::stoull(value);
    } else if (name == "slow") {
      all.sync_time = std::chrono::milliseconds{std::stoll(value)};
    } else if (name == "hold") {
      all.hold_file = value;
    } else if (name == "power") {
      all.power = true;
    } else if (name == "full") {
      all.limited = true;
      all.room = std::stoull(value);
    } else {
      throw std::invalid_argument("no such order to the disk: " + order);
    }
  }
  all.below = sqlite3_vfs_find(nullptr);
  static sqlite3_vfs faulty = *all.below;
  faulty.pNext = nullptr;
  faulty.zName = "faulty";
  faulty.szOsFile = static_cast<int>(sizeof(File)) + all.below->szOsFile;
  faulty.xOpen = open_file;
  faulty.xDelete = delete_file;
  sqlite3_vfs_register(&faulty, 1);
}

}  // namespace sinerig::test
