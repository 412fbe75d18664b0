#include "cli/output_file.h"

#include <filesystem>
#include <fstream>

#include "record/database.h"

namespace sinerig::cli {

void refuse_existing(const std::string& path, bool force) {
  if (force || !std::filesystem::exists(path)) return;
  throw record::FileExists(
      path + ": exists already; choose another name with -o, or --force to replace it");
}

void write_file(const std::string& path, bool force,
                const std::function<void(std::ostream&)>& write) {
  refuse_existing(path, force);
  std::ofstream stream{path, std::ios::binary};
  if (stream) write(stream);
  stream.close();
  if (!stream) throw record::SweepFileError(path + ": cannot be written");
}

}  // namespace sinerig::cli
