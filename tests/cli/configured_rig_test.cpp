// In which order the devices of a rig are asked and armed.
#include "cli/configured_rig.h"

#include <cstdlib>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>

namespace sinerig::cli {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::ThrowsMessage;

struct Story {
  std::vector<std::string> lines;
  bool interlock_open = false;
  int asked = 0;                         // the interlock
  std::function<void()> while_it_homes;  // at each turn of the drive's arm list
};

class Drive final : public Device, public Actuator {
 public:
  explicit Drive(Story& story) : story_{story} {}
  void open(const Clock& /*clock*/) override {}
  void arm() override {
    story_.lines.emplace_back("homing");
    for (int turn = 0; turn < 3; ++turn) {
      if (story_.while_it_homes) story_.while_it_homes();
      waiting().go_on();
    }
    story_.lines.emplace_back("armed");
  }
  void rearm() override {
    story_.lines.emplace_back("set up again");
    arm();
  }
  Actuator* actuator() noexcept override { return this; }
  Sensor& sensor(std::size_t /*index*/) noexcept override { std::abort(); }
  Sample write(double command) noexcept override { return {.value = command}; }
  void release() noexcept override { story_.lines.emplace_back("released"); }

 private:
  Story& story_;
};

class Door final : public Device, public Sensor {
 public:
  explicit Door(Story& story) : story_{story} {}
  void open(const Clock& /*clock*/) override {}
  void check_may_arm() const override {
    ++story_.asked;
    if (story_.interlock_open) throw std::runtime_error{"door: the interlock is open"};
  }
  void arm() override {
    check_may_arm();
    story_.lines.emplace_back("door armed");
  }
  Actuator* actuator() noexcept override { return nullptr; }
  Sensor& sensor(std::size_t /*index*/) noexcept override { return *this; }
  Sample read() noexcept override { return {.value = 1.0}; }

 private:
  Story& story_;
};

// The drive is armed first, as one on a CAN bus is beside GPIO lines.
class DriveAndDoor : public testing::Test {
 protected:
  DriveAndDoor()
      : rig{config::RigFile::parse(
                "[loop]\nrate_hz = 500\n"
                "[sweep]\nstart_hz = 1\nstop_hz = 50\npoints = 5\namplitude = 0.5\n[limits]\n"
                "[actuator]\ndriver = \"drive\"\n[sensor.door]\ndriver = \"door\"\n",
                "rig.toml"),
            {{.name = "drive",
              .summary = "",
              .configure =
                  [this](const DeviceRequest&) {
                    return std::make_unique<Drive>(story);
                  }},
             {.name = "door", .summary = "", .configure = [this](const DeviceRequest&) {
                return std::make_unique<Door>(story);
              }}}} {
    rig.open();
  }

  Story story;
  ConfiguredRig rig;
};

TEST_F(DriveAndDoor, AreArmedInTheirOrderWhileTheInterlockIsClosed) {
  rig.arm();
  EXPECT_THAT(story.lines, ElementsAre("homing", "armed", "door armed"));
  rig.keep_released();
  const int asked = story.asked;
  EXPECT_EQ(Waiting{rig.control()}.may_go_on(), true);
  EXPECT_EQ(story.asked, asked) << "once armed the guard watches it";
}

TEST_F(DriveAndDoor, NoneIsArmedWhileTheInterlockIsOpen) {
  story.interlock_open = true;
  EXPECT_THAT([this] { rig.arm(); }, ThrowsMessage<NotToBeArmed>("door: the interlock is open"));
  EXPECT_THAT(story.lines, ElementsAre("released"));
}

TEST_F(DriveAndDoor, NoneIsArmedAgainWhileTheInterlockIsOpen) {
  rig.arm();
  story.lines.clear();
  story.interlock_open = true;
  EXPECT_EQ(rig.arm_again(), "door: the interlock is open");
  EXPECT_THAT(story.lines, ElementsAre("released"));
  story.interlock_open = false;
  EXPECT_THAT(rig.arm_again(), IsEmpty());
}

TEST_F(DriveAndDoor, AnInterlockThatOpensEndsTheListOfTheDriveEvenIfItClosesAgain) {
  int turn = 0;
  story.while_it_homes = [&] {
    story.interlock_open = ++turn == 2;
  };
  EXPECT_THAT([this] { rig.arm(); }, ThrowsMessage<NotToBeArmed>("door: the interlock is open"));
  EXPECT_THAT(story.lines, ElementsAre("homing", "released"));
  EXPECT_EQ(turn, 2);
}

TEST_F(DriveAndDoor, AStopRequestIsNoObjection) {
  story.while_it_homes = [this] {
    rig.control().stop_requests = 1;
  };
  EXPECT_THROW(rig.arm(), StopRequested);
  EXPECT_THAT(story.lines, ElementsAre("homing", "released"));
}

}  // namespace
}  // namespace sinerig::cli
