// Room on the disk that is held back for the last words of a run: what it was stopped by, and the
// points that the full disk had no room for.
#pragma once

#include <cstddef>
#include <string>

namespace sinerig::record {

class SpareRoom {
 public:
  // Some twenty pages of the log, ten times what the last words have taken.
  static constexpr std::size_t bytes = std::size_t{256} * 1024;

  // Takes the room, in a file NAME-spare beside the sweep file. Throws SweepFileError when there is
  // none: then a run had better not begin.
  explicit SpareRoom(const std::string& sweep_file);
  ~SpareRoom();
  SpareRoom(const SpareRoom&) = delete;
  SpareRoom& operator=(const SpareRoom&) = delete;

  void give_back() noexcept;

 private:
  std::string path_;
};

}  // namespace sinerig::record
