// What a rig file leads to is part of what a run began with.
#include "cli/included_files.h"

#include <filesystem>
#include <fstream>
#include <unistd.h>

#include <gmock/gmock.h>

#include "cli/configured_rig.h"
#include "drivers/can/can_driver.h"
#include "support/rig_text.h"

namespace sinerig::cli {
namespace {

namespace fs = std::filesystem;

class IncludedFiles : public testing::Test {
 protected:
  IncludedFiles() {
    fs::create_directories(folder_);
    fs::copy(test::shipped("can-gimbal.toml"), folder_);
    fs::copy(test::shipped("devices"), folder_ / "devices");
  }

  ~IncludedFiles() override { fs::remove_all(folder_); }

  // As a run begins, and as one is taken up again.
  std::unique_ptr<ConfiguredRig> configured() const {
    return std::make_unique<ConfiguredRig>((folder_ / "can-gimbal.toml").string(),
                                           std::vector{can::can_driver()});
  }

  void append(const std::string& name, const std::string& text) const {
    std::ofstream{folder_ / name, std::ios::app} << text;
  }

  const fs::path folder_ =
      fs::path{testing::TempDir()} / ("included-files-" + std::to_string(getpid()));
};

TEST_F(IncludedFiles, AreTheProfileAndItsDbc) {
  const auto rig = configured();
  std::vector<std::string> names;
  for (const auto& [path, digest] : rig->rig().file->included()) {
    EXPECT_TRUE(fs::path{path}.is_absolute()) << path;
    names.push_back(fs::path{path}.filename());
  }
  EXPECT_THAT(names, testing::UnorderedElementsAre("odrive.toml", "odrive-cansimple.dbc"));
}

TEST_F(IncludedFiles, TellWhichHasChangedSinceTheRunBegan) {
  record::StoredRun run;
  run.facts = {{"included", included_text(configured()->rig())}};
  EXPECT_EQ(changed_include(run, configured()->rig()), "");
  append("devices/odrive-cansimple.dbc", "\nCM_ \"edited\";\n");
  EXPECT_THAT(changed_include(run, configured()->rig()), testing::EndsWith("odrive-cansimple.dbc"));
  run.facts = {{"included", included_text(configured()->rig())}};
  append("devices/odrive.toml", "# edited\n");
  EXPECT_THAT(changed_include(run, configured()->rig()), testing::EndsWith("odrive.toml"));
}

TEST_F(IncludedFiles, AreTheSameByWhateverLink) {
  record::StoredRun run;
  run.facts = {{"included", included_text(configured()->rig())}};
  fs::create_directory_symlink(folder_, folder_ / "link");
  const ConfiguredRig linked{(folder_ / "link/can-gimbal.toml").string(),
                             std::vector{can::can_driver()}};
  EXPECT_EQ(changed_include(run, linked.rig()), "");
  const fs::path elsewhere = folder_ / "elsewhere";
  fs::create_directories(elsewhere);
  fs::copy(test::shipped("can-gimbal.toml"), elsewhere);
  fs::copy(test::shipped("devices"), elsewhere / "devices");
  const ConfiguredRig moved{(elsewhere / "can-gimbal.toml").string(),
                            std::vector{can::can_driver()}};
  EXPECT_EQ(changed_include(run, moved.rig()), "");
}

TEST_F(IncludedFiles, OfAFileThatDoesNotSayAreTakenAsTheyAre) {
  EXPECT_EQ(changed_include(record::StoredRun{}, configured()->rig()), "");
}

}  // namespace
}  // namespace sinerig::cli
