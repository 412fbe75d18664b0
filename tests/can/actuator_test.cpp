// The actuator and what it sends when, against a device that is simulated in the process.
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "drivers/can/can_actuator.h"
#include "drivers/can/can_driver.h"
#include "tests/can/fake_socket.h"
#include "tests/can/shipped_profile.h"

namespace sinerig::can {
namespace {

Frame frame_of(std::uint32_t id, const std::vector<std::uint8_t>& bytes) {
  Frame frame;
  frame.id = id;
  frame.length = static_cast<std::uint8_t>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), frame.data.begin());
  return frame;
}

// Nothing here waits in real time.
CommandSettings without_delays(CommandSettings settings) {
  for (Sequence* list : {&settings.startup, &settings.arm, &settings.disarm, &settings.shutdown})
    for (Step& step : *list) step.delay_ns = 0;
  return settings;
}

class CanActuatorAlone : public testing::Test {
 protected:
  void SetUp() override { wire = FakeBus{}; }
  void TearDown() override { wire = FakeBus{}; }

  FakeBus& wire = FakeBus::instance();
};

// The state machine of CiA 402 behind node 4, by SDO and by a process data object that a SYNC
// takes.
struct Cia402Drive {
  enum State : std::uint16_t {
    switch_on_disabled = 0x0240,
    ready = 0x0221,
    switched_on = 0x0223,
    enabled = 0x0227,
  };

  std::uint16_t state = switch_on_disabled;
  bool operational = false;
  std::vector<std::uint16_t> states;  // every one that it was in
  std::uint16_t mapped = 0;

  void control(std::uint16_t word) {
    if ((word & 0x86U) == 0x06 && (word & 0x01U) == 0) state = ready;
    if ((word & 0x8FU) == 0x07 && state != switch_on_disabled) state = switched_on;
    if ((word & 0x8FU) == 0x0F && state != switch_on_disabled && state != ready) state = enabled;
    states.push_back(state);
  }

  std::vector<Frame> answer(const Frame& frame) {
    const auto& d = frame.data;
    if (frame.id == 0x000) operational = d[0] == 0x01;
    if (frame.id == 0x204) mapped = static_cast<std::uint16_t>(d[0] | d[1] << 8U);
    if (frame.id == 0x080 && operational) control(mapped);
    if (frame.id != 0x604) return {};
    if (d[0] == 0x40)
      return {frame_of(0x584, {0x4B, d[1], d[2], d[3], static_cast<std::uint8_t>(state & 0xFFU),
                               static_cast<std::uint8_t>(state >> 8U), 0, 0})};
    if (d[1] == 0x40 && d[2] == 0x60) control(static_cast<std::uint16_t>(d[4] | d[5] << 8U));
    return {frame_of(0x584, {0x60, d[1], d[2], d[3], 0, 0, 0, 0})};
  }
};

TEST_F(CanActuatorAlone, ACia402DriveIsSwitchedOnByArmingAndOffByRelease) {
  for (const char* command : {"torque", "position"}) {
    Cia402Drive drive;
    wire.device = [&](const Frame& frame) {
      return drive.answer(frame);
    };
    Bus bus("fake", false);
    CanActuator actuator(bus, without_delays(Profile("cia402.toml", 4).command(command)));
    actuator.start();
    EXPECT_THAT(drive.states, testing::Each(Cia402Drive::ready)) << "it was off and stays off";
    actuator.arm();
    EXPECT_EQ(drive.state, Cia402Drive::enabled);
    actuator.write(0.1);
    drive.states.clear();
    actuator.release();
    EXPECT_TRUE(actuator.released());
    EXPECT_THAT(drive.states, testing::Each(Cia402Drive::ready));
    EXPECT_EQ(drive.state, Cia402Drive::ready);
  }
}

// Its set-points say "enable operation": neutral must go out without saying so.
TEST_F(CanActuatorAlone, AStopWhileACia402DriveIsSwitchedOnDoesNotEnableIt) {
  Cia402Drive drive;
  RunControl control;
  wire.device = [&](const Frame& frame) -> std::vector<Frame> {
    const std::vector<Frame> answers = drive.answer(frame);
    if (drive.state != Cia402Drive::switched_on || frame.data[0] != 0x40) return answers;
    control.stop_requests = 1;
    return {};
  };
  Bus bus("fake", false, Waiting{control});
  CanActuator actuator(bus, without_delays(Profile("cia402.toml", 4).command("torque")));
  actuator.start();
  EXPECT_THROW(actuator.arm(), StopRequested);
  EXPECT_THAT(drive.states, testing::Contains(Cia402Drive::switched_on));
  EXPECT_THAT(drive.states, testing::Not(testing::Contains(Cia402Drive::enabled)));
  EXPECT_EQ(drive.state, Cia402Drive::ready);
}

TEST_F(CanActuatorAlone, AReleaseThatIsRepeatedLeavesACia402DriveOff) {
  Cia402Drive drive;
  bool deaf = false;
  wire.device = [&](const Frame& frame) {
    const std::vector<Frame> answers = drive.answer(frame);
    return deaf ? std::vector<Frame>{} : answers;
  };
  Bus bus("fake", false);
  CanActuator actuator(bus, without_delays(Profile("cia402.toml", 4).command("torque")));
  actuator.start();
  actuator.arm();
  deaf = true;
  drive.states.clear();
  actuator.release();
  EXPECT_FALSE(actuator.released()) << "nobody said that it is off";
  deaf = false;
  actuator.release();
  EXPECT_TRUE(actuator.released());
  EXPECT_THAT(drive.states, testing::Each(Cia402Drive::ready));
}

TEST_F(CanActuatorAlone, AMoteusIsStoppedByTheVeryFrameThatCarriesNeutral) {
  wire.device = [](const Frame& frame) -> std::vector<Frame> {
    if (frame.id != 0x8001) return {};
    Frame answer = frame_of(0x100, std::vector<std::uint8_t>(20, 0));
    answer.fd = true;
    answer.data[16] = frame.data[2];
    return {answer};
  };
  Bus bus("fake", true);
  CanActuator actuator(bus, Profile("moteus.toml", 1).command("torque"));
  actuator.start();
  actuator.arm();
  actuator.write(0.5);
  wire.sent.clear();
  actuator.release();
  EXPECT_TRUE(actuator.released());
  ASSERT_FALSE(wire.sent.empty());
  for (const Frame& frame : wire.sent) EXPECT_EQ(frame.data[2], 0x00) << "mode";
  EXPECT_EQ(wire.sent.front().length, 32);
  EXPECT_EQ(decode(wire.sent.front().payload(), Profile("moteus.toml", 1).command("torque").signal),
            0.0);
}

// `sinerig check` opens a rig and arms nothing: an axis that somebody else holds keeps its mode.
TEST_F(CanActuatorAlone, AnODriveThatIsOnlyLookedAtKeepsItsMode) {
  wire.device = [](const Frame& frame) -> std::vector<Frame> {
    if (frame.id != 0x67 || frame.data[0] != 8) return {};
    return {frame_of(0x61, {0, 0, 0, 0, 8, 0, 0, 0})};
  };
  for (const char* command : {"torque", "velocity", "position"}) {
    wire.sent.clear();
    Bus bus("fake", false);
    CanActuator actuator(bus, Profile("odrive.toml", 3).command(command));
    const auto sent_ids = [&] {
      std::vector<std::uint32_t> ids;
      for (const Frame& frame : wire.sent) ids.push_back(frame.id);
      return ids;
    };
    actuator.start();
    EXPECT_THAT(sent_ids(), testing::ElementsAre(0x78u)) << "clear errors";
    wire.sent.clear();
    actuator.arm();
    EXPECT_THAT(sent_ids(), testing::ElementsAre(testing::_, 0x6Bu, 0x67u))
        << "neutral, mode, closed loop";
  }
}

CommandSettings command_with(const std::vector<KeepAlive>& keep_alive) {
  CommandSettings settings;
  settings.frame = frame_of(0x0E, {0, 0});
  settings.signal.length = 16;
  settings.keep_alive = keep_alive;
  return settings;
}

// A tick is up to 50 µs off: of a period of one tick none may be left out.
TEST_F(CanActuatorAlone, KeepAliveFramesKeepTheirPeriodOnTicksThatJitter) {
  constexpr std::int64_t tick_ns = 10'000'000;
  constexpr int ticks = 10'000;
  for (const std::int64_t ticks_per_period : {1, 2, 5}) {
    wire = FakeBus{};
    Bus bus("fake", false);
    CanActuator actuator(bus, command_with({{frame_of(0x700, {5}), ticks_per_period * tick_ns}}));
    std::int64_t last_ns = 0;
    std::int64_t longest_ns = 0;
    int count = 0;
    for (int tick = 0; tick < ticks; ++tick) {
      wire.now_ns = 1'000'000'000 + tick * tick_ns + 50'000 - tick * 7919 % 101 * 1000;
      wire.sent.clear();
      actuator.write(0.0);
      if (wire.sent.back().id != 0x700) continue;
      if (last_ns != 0) longest_ns = std::max(longest_ns, wire.now_ns - last_ns);
      last_ns = wire.now_ns;
      ++count;
    }
    EXPECT_EQ(count, ticks / ticks_per_period);
    EXPECT_LE(longest_ns, ticks_per_period * tick_ns + 100'000);
  }
}

TEST_F(CanActuatorAlone, AfterAPauseKeepAliveFramesAreNotMadeUpFor) {
  Bus bus("fake", false);
  CanActuator actuator(bus, command_with({{frame_of(0x700, {5}), 10'000'000}}));
  actuator.write(0.0);
  wire.now_ns += 5'000'000'000;
  wire.sent.clear();
  for (int tick = 0; tick < 10; ++tick) {
    actuator.write(0.0);
    wire.now_ns += 1'000'000;
  }
  EXPECT_LE(wire.sent.size(), 10u + 2u);
}

TEST_F(CanActuatorAlone, ASetPointWithoutItsSyncIsNotApplied) {
  Bus bus("fake", false);
  CanActuator actuator(bus, command_with({{frame_of(0x80, {}), 0}}));
  EXPECT_EQ(actuator.write(1.0).fault, Fault::none);
  wire.refuses = [](const Frame& frame) {
    return frame.id == 0x80 ? SendResult::queue_full : SendResult::sent;
  };
  const Sample lost = actuator.write(2.0);
  EXPECT_EQ(lost.fault, Fault::bus);
  EXPECT_EQ(lost.value, 1.0);
  EXPECT_THAT(actuator.reason(), testing::HasSubstr("the transmit queue is full"));
  wire.refuses = {};
  EXPECT_EQ(actuator.write(3.0).value, 3.0);
}

// The whole device, as a rig file makes it.
struct Opened {
  config::Rig rig;
  std::unique_ptr<Device> device;
  VirtualClock clock{TickGrid{1000.0}};

  explicit Opened(const std::string& actuator)
      : rig(config::read_rig(config::RigFile::parse(
            "[loop]\nrate_hz = 1000\n[sweep]\nstart_hz = 1\nstop_hz = 10\npoints = 3\n"
            "amplitude = 0.1\n[limits]\n[sensor.s]\ndriver = \"sim\"\n[actuator]\n"
            "driver = \"can\"\ninterface = \"fake\"\nid = 1\nlength = 8\nstart_bit = 0\n" +
                actuator,
            "rig.toml"))),
        device(can_driver().configure({rig, &rig.actuator, {}})) {
    device->open(clock);
  }
};

TEST_F(CanActuatorAlone, HealthInAnFdFrameNeedsAnInterfaceThatTakesThem) {
  const std::string rule = "[[actuator.health]]\nname = \"x\"\nid = 3\nstart_bit = 0\nequals = 0\n";
  EXPECT_FALSE((Opened{rule}, wire.fd_frames));
  EXPECT_TRUE((Opened{rule + "fd = true\n"}, wire.fd_frames));
}

TEST_F(CanActuatorAlone, RemarksTellWhatWasDropped) {
  Opened opened("");
  opened.device->actuator()->write(0.0);
  for (const SendResult refused :
       {SendResult::queue_full, SendResult::queue_full, SendResult::failed}) {
    wire.refuses = [&](const Frame&) {
      return refused;
    };
    opened.device->actuator()->write(0.0);
  }
  wire.refuses = {};
  EXPECT_THAT(
      opened.device->remarks().at(0).text,
      testing::HasSubstr("can fake: 1 frames sent, 2 dropped at a full queue, 1 at a dead bus"));
}

}  // namespace
}  // namespace sinerig::can
