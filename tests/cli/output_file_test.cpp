#include "cli/output_file.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <ostream>
#include <stdexcept>
#include <unistd.h>

#include <gtest/gtest.h>

#include "record/database.h"

namespace sinerig::cli {
namespace {

namespace fs = std::filesystem;

class OutputFile : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directory(folder_);
    std::ofstream{path_} << "old";
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string text(const fs::path& path) const {
    std::ifstream stream{path};
    return {std::istreambuf_iterator<char>{stream}, {}};
  }
  std::size_t files() const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator{folder_}, fs::directory_iterator{}));
  }
  static void write_new(std::ostream& stream) { stream << "new"; }

  fs::path folder_ = fs::temp_directory_path() / ("sinerig-output-" + std::to_string(getpid()));
  std::string path_ = (folder_ / "axis.html").string();
};

TEST_F(OutputFile, IsReplacedAsAWhole) {
  fs::permissions(path_, fs::perms::owner_read | fs::perms::owner_write);
  write_file(path_, true, write_new);
  EXPECT_EQ(text(path_), "new");
  EXPECT_EQ(fs::status(path_).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_EQ(files(), 1U);
}

TEST_F(OutputFile, IsLeftAsItIsByAWriterThatFails) {
  EXPECT_THROW(write_file(path_, true,
                          [](std::ostream& stream) {
                            stream << "half of the n";
                            throw std::runtime_error{"out of memory"};
                          }),
               std::runtime_error);
  EXPECT_EQ(text(path_), "old");
  EXPECT_EQ(files(), 1U);
}

TEST_F(OutputFile, IsNotReplacedUnasked) {
  EXPECT_THROW(write_file(path_, false, write_new), record::FileExists);
  EXPECT_EQ(text(path_), "old");
}

TEST_F(OutputFile, IsWhereALinkLeadsTo) {
  const fs::path link = folder_ / "latest.html";
  fs::create_symlink("axis.html", link);
  write_file(link.string(), true, write_new);
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_EQ(text(path_), "new");
}

TEST_F(OutputFile, MayBeADevice) {
  write_file("/dev/null", true, write_new);
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(OutputFile, SaysThatItCannotBeWritten) {
  EXPECT_THROW(write_file((folder_ / "none" / "axis.html").string(), false, write_new),
               record::SweepFileError);
}

}  // namespace
}  // namespace sinerig::cli
