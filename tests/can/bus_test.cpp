// The CAN driver on a kernel's CAN stack: run inside tools/virtual-bench, on its vcan0.
#include "drivers/can/bus.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <limits>
#include <net/if.h>
#include <stdexcept>
#include <string>
#include <thread>
#include <unistd.h>
#include <vector>

#include <gmock/gmock.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <sys/socket.h>
#include <system_error>

#include "drivers/can/can_actuator.h"
#include "drivers/can/can_sensor.h"

namespace sinerig::can {
namespace {

using testing::HasSubstr;

void shell(const std::string& command) {
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
}

Signal float_at(unsigned start_bit) {
  Signal signal;
  signal.start_bit = static_cast<std::uint16_t>(start_bit);
  signal.length = 32;
  signal.encoding = Encoding::float32;
  return signal;
}

Signal byte_at(unsigned position) {
  Signal signal;
  signal.start_bit = static_cast<std::uint16_t>(position * 8);
  return signal;
}

Frame frame_of(std::uint32_t id, const std::vector<std::uint8_t>& bytes) {
  Frame frame;
  frame.id = id;
  frame.length = static_cast<std::uint8_t>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), frame.data.begin());
  return frame;
}

Frame float_frame(std::uint32_t id, double value) {
  Frame frame = frame_of(id, {0, 0, 0, 0, 0, 0, 0, 0});
  encode(frame.payload(), float_at(0), value);
  return frame;
}

Pattern pattern_of(std::uint32_t id, std::uint8_t minimum_length = 8) {
  Pattern pattern;
  pattern.id = id;
  pattern.minimum_length = minimum_length;
  return pattern;
}

constexpr std::uint32_t command_id = 0x0E;
constexpr std::uint32_t feedback_id = 0x09;

CommandSettings torque_command() {
  CommandSettings settings;
  settings.frame = frame_of(command_id, {0, 0, 0, 0, 0, 0, 0, 0});
  settings.signal = float_at(0);
  return settings;
}

FeedbackSettings position_feedback() {
  FeedbackSettings settings;
  settings.pattern = pattern_of(feedback_id);
  settings.signal = float_at(0);
  return settings;
}

// Somebody else on the bus.
class Peer {
 public:
  explicit Peer(bool fd = false) : socket_("vcan0", fd) {}

  // In virtual time the kernel's own threads run, and deliver, when this one lets time pass.
  void send(const Frame& frame) {
    ASSERT_EQ(socket_.send(frame), SendResult::sent);
    usleep(10);
  }

  // Every frame that has arrived, oldest first.
  std::vector<Frame> received() {
    std::vector<Frame> frames;
    Received next;
    while (true) {
      const ReceiveResult result = socket_.receive(next);
      if (result == ReceiveResult::frame) frames.push_back(next.frame);
      if (result == ReceiveResult::nothing) return frames;
    }
  }

  // A frame that says what the controller of a real adapter says about the bus.
  static void inject_error(std::uint32_t error_class) {
    const int fd = socket(PF_CAN, SOCK_RAW, CAN_RAW);
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(if_nametoindex("vcan0"));
    ASSERT_EQ(bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    can_frame frame{};
    frame.can_id = CAN_ERR_FLAG | error_class;
    frame.can_dlc = CAN_ERR_DLC;
    ASSERT_EQ(write(fd, &frame, sizeof frame), static_cast<ssize_t>(sizeof frame));
    close(fd);
  }

 private:
  Socket socket_;
};

// Answers frames from a thread of its own, for what waits for an answer.
class AnsweringPeer {
 public:
  explicit AnsweringPeer(std::function<std::vector<Frame>(const Frame&)> answers)
      : socket_("vcan0", false), thread_([this, answers = std::move(answers)] {
          while (!done_) {
            socket_.wait(10'000'000);
            Received next;
            while (socket_.receive(next) == ReceiveResult::frame)
              for (const Frame& frame : answers(next.frame)) socket_.send(frame);
          }
        }) {}
  ~AnsweringPeer() {
    done_ = true;
    thread_.join();
  }

 private:
  std::atomic<bool> done_{false};
  Socket socket_;
  std::thread thread_;
};

class CanBus : public testing::Test {
 protected:
  void SetUp() override {
    std::system("ip link del vcan0 2>/dev/null");
    shell("ip link add dev vcan0 type vcan && ip link set vcan0 mtu 72 up");
  }
};

std::string refusal_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST_F(CanBus, ACommandGoesOutOnceWithTheAppliedValue) {
  Peer peer;
  Bus bus("vcan0", false);
  CanActuator actuator(bus, torque_command());
  bus.start();
  const Sample applied = actuator.write(0.1);
  EXPECT_EQ(applied.fault, Fault::none);
  EXPECT_EQ(applied.value, static_cast<double>(0.1F));
  EXPECT_THAT(peer.received(), testing::ElementsAre(float_frame(command_id, 0.1)));
}

TEST_F(CanBus, TheNewestFrameWinsAndIsStaleTheSecondTime) {
  Peer peer;
  Bus bus("vcan0", false);
  CanSensor sensor(bus, position_feedback());
  bus.start();
  EXPECT_EQ(sensor.read().fault, Fault::stale);
  for (const double value : {1.0, 2.0, 3.0}) peer.send(float_frame(feedback_id, value));
  const Sample newest = sensor.read();
  EXPECT_EQ(newest.fault, Fault::none);
  EXPECT_EQ(newest.value, 3.0);
  const Sample again = sensor.read();
  EXPECT_EQ(again.fault, Fault::stale);
  EXPECT_EQ(again.value, 3.0);
  EXPECT_EQ(again.time_ns, newest.time_ns);
}

// What the kernel kept of a long wait are the oldest frames.
TEST_F(CanBus, NothingThatCameDuringAWaitIsNewAfterCatchingUp) {
  Peer peer;
  Bus bus("vcan0", false);
  CommandSettings command = torque_command();
  HealthRule state;
  state.pattern = pattern_of(0x01);
  state.signal = byte_at(4);
  state.value = 8.0;
  command.health = {state};
  CanActuator actuator(bus, command);
  FeedbackSettings angle = position_feedback();
  angle.timeout_ns = 20'000'000;
  CanSensor sensor(bus, angle);
  bus.start();
  EXPECT_EQ(sensor.read().fault, Fault::stale);
  for (int n = 0; n < 20000; ++n) peer.send(float_frame(feedback_id, n));
  bus.drain();
  sensor.catch_up();
  EXPECT_EQ(sensor.read().fault, Fault::stale);
  EXPECT_GT(bus.counters().received, 0u);

  peer.send(frame_of(0x01, {0, 0, 0, 0, 1, 0, 0, 0}));  // of before it was armed
  bus.drain();
  actuator.arm();
  EXPECT_EQ(actuator.write(0.0).fault, Fault::none) << actuator.reason();
  peer.send(float_frame(feedback_id, 7.0));
  EXPECT_EQ(sensor.read().value, 7.0);
}

TEST_F(CanBus, ASampleIsAsOldAsItsFrameNotAsItsReading) {
  Peer peer;
  Bus bus("vcan0", false);
  CanSensor sensor(bus, position_feedback());
  bus.start();
  const std::int64_t before_ns = monotonic_ns();
  peer.send(float_frame(feedback_id, 1.0));
  const std::int64_t after_ns = monotonic_ns();
  usleep(5000);
  const Sample sample = sensor.read();
  EXPECT_GE(sample.time_ns, before_ns);
  EXPECT_LE(sample.time_ns, after_ns);
}

// NTP that finds the clock an hour off sets it at once.
TEST_F(CanBus, ASampleIsNoOlderWhenTheWallClockIsSet) {
  const auto set_by = [](std::int64_t seconds) {
    timespec time{};
    clock_gettime(CLOCK_REALTIME, &time);
    time.tv_sec += seconds;
    return clock_settime(CLOCK_REALTIME, &time) == 0;
  };
  Peer peer;
  Bus bus("vcan0", false);
  CanSensor sensor(bus, position_feedback());
  bus.start();
  for (const std::int64_t step_s : {3600, -3600}) {
    const std::int64_t before_ns = monotonic_ns();
    peer.send(float_frame(feedback_id, 1.0));
    ASSERT_TRUE(set_by(step_s));
    EXPECT_GE(sensor.read().time_ns, before_ns);
    EXPECT_EQ(sensor.read().fault, Fault::stale);
    peer.send(float_frame(feedback_id, 2.0));
    const std::int64_t after_ns = monotonic_ns();
    usleep(5000);
    const Sample next = sensor.read();
    EXPECT_GE(next.time_ns, before_ns);
    EXPECT_LE(next.time_ns, after_ns) << "stamped by the clock as it is now";
  }
}

TEST_F(CanBus, OnlyMatchingFramesCount) {
  Peer peer;
  Bus bus("vcan0", false);
  FeedbackSettings torque_reply = position_feedback();
  torque_reply.pattern = pattern_of(0x241);
  torque_reply.pattern.require_byte(0, 0xA1);
  torque_reply.signal = byte_at(1);
  CanSensor sensor(bus, torque_reply);
  bus.start();
  peer.send(frame_of(0x241, {0x9C, 7, 0, 0, 0, 0, 0, 0}));
  peer.send(frame_of(0x242, {0xA1, 8, 0, 0, 0, 0, 0, 0}));
  peer.send(frame_of(0x241, {0xA1, 9}));
  Frame extended = frame_of(0x241, {0xA1, 10, 0, 0, 0, 0, 0, 0});
  extended.extended = true;
  peer.send(extended);
  Frame request = frame_of(0x241, {});
  request.remote = true;
  peer.send(request);
  EXPECT_EQ(sensor.read().fault, Fault::stale);
  peer.send(frame_of(0x241, {0xA1, 11, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(sensor.read().value, 11.0);
}

TEST_F(CanBus, ForeignTrafficIsFilteredByTheKernel) {
  Peer peer;
  Bus bus("vcan0", false);
  CanSensor sensor(bus, position_feedback());
  bus.start();
  for (int n = 0; n < 20000; ++n) peer.send(float_frame(0x555, n));
  peer.send(float_frame(feedback_id, 1.0));
  EXPECT_EQ(sensor.read().value, 1.0);
  EXPECT_EQ(bus.counters().overflows, 0u);
}

TEST_F(CanBus, FramesThatTheKernelHadToDropAreCounted) {
  Peer peer;
  Bus bus("vcan0", false);
  CanSensor sensor(bus, position_feedback());
  bus.start();
  for (int n = 0; n < 20000; ++n) peer.send(float_frame(feedback_id, n));
  while (sensor.read().fault == Fault::none) {
  }
  peer.send(float_frame(feedback_id, 1.0));
  sensor.read();
  sensor.read();
  EXPECT_GT(bus.counters().overflows, 0u);
  EXPECT_EQ(bus.counters().overflows + bus.counters().received, 20001u);
}

TEST_F(CanBus, FdFramesCarry64BytesAndTheFastRateFlag) {
  Peer peer(true);
  Bus bus("vcan0", true);
  CommandSettings command = torque_command();
  command.frame = frame_of(0x8001, std::vector<std::uint8_t>(64, 0x50));
  command.frame.extended = command.frame.fd = command.frame.bit_rate_switch = true;
  command.signal = float_at(480);
  CanActuator actuator(bus, command);
  FeedbackSettings feedback;
  feedback.pattern = pattern_of(0x100, 12);
  feedback.pattern.extended = true;
  feedback.signal = float_at(64);
  CanSensor sensor(bus, feedback);
  bus.start();

  EXPECT_EQ(actuator.write(-2.5).fault, Fault::none);
  const std::vector<Frame> seen = peer.received();
  ASSERT_EQ(seen.size(), 1u);
  EXPECT_TRUE(seen[0].fd && seen[0].bit_rate_switch && seen[0].extended);
  EXPECT_EQ(seen[0].length, 64);
  EXPECT_EQ(decode(seen[0].payload(), float_at(480)), -2.5);
  EXPECT_EQ(seen[0].data[0], 0x50);

  Frame reply = frame_of(0x100, std::vector<std::uint8_t>(12, 0));
  reply.extended = reply.fd = true;
  encode(reply.payload(), float_at(64), 4.5);
  peer.send(reply);
  EXPECT_EQ(sensor.read().value, 4.5);
}

TEST_F(CanBus, AFullQueueDropsTheCommandForGood) {
  Bus bus("vcan0", false);
  CanActuator actuator(bus, torque_command());
  bus.start();
  shell("tc qdisc replace dev vcan0 root tbf rate 8kbit burst 64 limit 160");
  Peer peer;
  int dropped = 0;
  double held = 0.0;
  for (int n = 1; n <= 60; ++n) {
    const Sample applied = actuator.write(n);
    if (applied.fault == Fault::none) {
      held = n;
    } else {
      ++dropped;
      EXPECT_EQ(applied.fault, Fault::bus);
      EXPECT_EQ(applied.value, held) << "the device holds what it got last";
      EXPECT_THAT(actuator.reason(), HasSubstr("transmit queue is full"));
    }
  }
  EXPECT_GT(dropped, 0);
  EXPECT_EQ(bus.counters().dropped_full, static_cast<std::uint64_t>(dropped));
  sleep(10);
  EXPECT_EQ(peer.received().size(), static_cast<std::size_t>(60 - dropped));
  EXPECT_EQ(actuator.write(1.0).fault, Fault::none);
  EXPECT_EQ(actuator.reason(), "");
}

TEST_F(CanBus, NothingIsSentWhileBusOffAndAllIsWellAfterTheRestart) {
  Peer peer;
  Bus bus("vcan0", false);
  CanActuator actuator(bus, torque_command());
  CanSensor sensor(bus, position_feedback());
  bus.start();
  EXPECT_EQ(actuator.write(1.0).fault, Fault::none);
  Peer::inject_error(CAN_ERR_BUSOFF);
  EXPECT_EQ(actuator.write(2.0).fault, Fault::bus);
  EXPECT_EQ(sensor.read().fault, Fault::bus);
  EXPECT_EQ(actuator.reason(),
            "vcan0: bus-off; a controller with restart-ms 0, the default, stays off: `ip link set "
            "vcan0 down`, then `… up type can restart-ms 100`");
  EXPECT_EQ(actuator.write(3.0).value, 1.0);
  EXPECT_EQ(bus.counters().bus_offs, 1u);
  EXPECT_EQ(bus.counters().dropped_dead, 2u);

  Peer::inject_error(CAN_ERR_RESTARTED);
  EXPECT_EQ(actuator.write(4.0).fault, Fault::none);
  EXPECT_THAT(peer.received(),
              testing::ElementsAre(float_frame(command_id, 1.0), float_frame(command_id, 4.0)));
}

TEST_F(CanBus, ALinkThatGoesDownFaultsAtTheNextTickAndComesBack) {
  Peer peer;
  Bus bus("vcan0", false);
  CanActuator actuator(bus, torque_command());
  CanSensor sensor(bus, position_feedback());
  bus.start();
  EXPECT_EQ(actuator.write(1.0).fault, Fault::none);
  shell("ip link set vcan0 down");
  EXPECT_EQ(sensor.read().fault, Fault::bus);
  EXPECT_EQ(actuator.write(2.0).fault, Fault::bus);
  EXPECT_THAT(actuator.reason(), HasSubstr("link down"));
  shell("ip link set vcan0 up");
  EXPECT_EQ(actuator.write(3.0).fault, Fault::none);
  peer.received();
  peer.send(float_frame(feedback_id, 5.0));
  EXPECT_EQ(sensor.read().value, 5.0);
}

TEST_F(CanBus, AnAdapterThatIsPulledAndPutBackIsFoundAgain) {
  Bus bus("vcan0", false);
  CanActuator actuator(bus, torque_command());
  CanSensor sensor(bus, position_feedback());
  bus.start();
  shell("ip link del vcan0");
  EXPECT_EQ(actuator.write(1.0).fault, Fault::bus);
  EXPECT_EQ(sensor.read().fault, Fault::bus);
  shell("ip link add dev dummy7 type vcan");  // the new interface must not get the old index
  shell("ip link add dev vcan0 type vcan && ip link set vcan0 up");
  Peer peer;
  bool back = false;
  for (int tick = 0; tick < 500 && !back; ++tick) {
    usleep(1000);
    back = actuator.write(2.0).fault == Fault::none;
  }
  EXPECT_TRUE(back);
  peer.send(float_frame(feedback_id, 6.0));
  const Sample sample = sensor.read();
  EXPECT_EQ(sample.fault, Fault::none);
  EXPECT_EQ(sample.value, 6.0);
  shell("ip link del dummy7");
}

TEST_F(CanBus, ReleaseSendsNeutralAndTheDisarmListOnce) {
  Peer peer;
  {
    Bus bus("vcan0", false);
    CommandSettings command = torque_command();
    command.neutral = 0.25;
    command.disarm = {{"idle", frame_of(0x07, {1, 0, 0, 0, 0, 0, 0, 0}), {}, 0, 1}};
    command.shutdown = {{"reboot", frame_of(0x16, {}), {}, 0, 1}};
    CanActuator actuator(bus, command);
    bus.start();
    actuator.start();
    actuator.write(1.0);
    actuator.release();
    actuator.release();
    EXPECT_THAT(peer.received(),
                testing::ElementsAre(float_frame(command_id, 1.0), float_frame(command_id, 0.25),
                                     frame_of(0x07, {1, 0, 0, 0, 0, 0, 0, 0})));
  }
  EXPECT_THAT(peer.received(), testing::ElementsAre(frame_of(0x16, {})));
}

TEST_F(CanBus, ReleaseWaitsForRoomInAFullQueue) {
  Peer peer;
  Bus bus("vcan0", false);
  CanActuator actuator(bus, torque_command());
  bus.start();
  shell("tc qdisc replace dev vcan0 root tbf rate 200kbit burst 64 limit 160");
  for (int n = 0; n < 60; ++n) actuator.write(1.0);
  EXPECT_GT(bus.counters().dropped_full, 0u);
  actuator.release();
  sleep(1);
  const std::vector<Frame> seen = peer.received();
  ASSERT_FALSE(seen.empty());
  EXPECT_EQ(seen.back(), float_frame(command_id, 0.0));
}

CommandSettings command_with_idle() {
  CommandSettings command = torque_command();
  command.disarm = {{"idle", frame_of(0x07, {1}), {}, 0, 1}};
  return command;
}

TEST_F(CanBus, ReleaseOnADeadBusReturns) {
  Bus bus("vcan0", false);
  CommandSettings command = torque_command();
  Expectation never;
  never.pattern = pattern_of(0x700);
  never.timeout_ns = 50'000'000;
  command.disarm = {{"idle", frame_of(0x07, {1}), never, 0, 1}};
  CanActuator actuator(bus, command);
  bus.start();
  actuator.write(1.0);
  shell("ip link set vcan0 down");
  const std::int64_t before_ns = monotonic_ns();
  actuator.release();
  EXPECT_LT(monotonic_ns() - before_ns, 1'000'000'000);
  EXPECT_FALSE(actuator.released());
  EXPECT_EQ(actuator.not_released(),
            "neutral has not gone out to the drive, which may still be on: vcan0");
}

TEST_F(CanBus, ReleaseOutlastsABusOffWithTheUsualRestart) {
  Peer peer;
  Bus bus("vcan0", false);
  CanActuator actuator(bus, command_with_idle());
  bus.start();
  actuator.arm();
  actuator.write(1.0);
  peer.received();
  Peer::inject_error(CAN_ERR_BUSOFF);
  EXPECT_EQ(actuator.write(1.0).fault, Fault::bus);
  std::thread controller([] {
    usleep(100'000);
    Peer::inject_error(CAN_ERR_RESTARTED);
  });
  actuator.release();
  controller.join();
  EXPECT_TRUE(actuator.released());
  EXPECT_THAT(actuator.reason(), HasSubstr("bus-off")) << "what it was, not what it is";
  EXPECT_THAT(peer.received(),
              testing::ElementsAre(float_frame(command_id, 0.0), frame_of(0x07, {1})));
}

TEST_F(CanBus, WhatReleaseCouldNotSendGoesOutWithTheNextOneOrTheEnd) {
  Peer peer;
  const auto neutral_and_idle =
      testing::ElementsAre(float_frame(command_id, 0.0), frame_of(0x07, {1}));
  Bus bus("vcan0", false);
  {
    CanActuator actuator(bus, command_with_idle());
    bus.start();
    const auto release_while_off = [&] {
      actuator.arm();
      actuator.write(1.0);
      peer.received();
      Peer::inject_error(CAN_ERR_BUSOFF);
      actuator.release();
      EXPECT_FALSE(actuator.released());
      EXPECT_TRUE(peer.received().empty());
      Peer::inject_error(CAN_ERR_RESTARTED);
    };
    release_while_off();
    actuator.release();
    EXPECT_THAT(peer.received(), neutral_and_idle);
    release_while_off();
    actuator.start();
    EXPECT_THAT(peer.received(), neutral_and_idle) << "before it is armed again";
    release_while_off();
  }
  EXPECT_THAT(peer.received(), neutral_and_idle);
}

TEST_F(CanBus, AWireThatTakesNothingKeepsFewSetPointsAndNeutralBehindThem) {
  Peer peer;
  Bus bus("vcan0", false);
  CanActuator actuator(bus, command_with_idle());
  bus.start();
  actuator.arm();
  peer.received();
  shell("tc qdisc replace dev vcan0 root tbf rate 8kbit burst 64 limit 100000");
  for (int n = 0; n < 60; ++n) actuator.write(1.0);
  EXPECT_GE(bus.counters().dropped_full, 45u);
  actuator.release();
  EXPECT_TRUE(actuator.released());
  sleep(2);
  const std::vector<Frame> seen = peer.received();
  ASSERT_GE(seen.size(), 4u);
  EXPECT_LE(seen.size(), 2u + 15u);
  EXPECT_EQ(seen[seen.size() - 2], float_frame(command_id, 0.0));
  EXPECT_EQ(seen.back(), frame_of(0x07, {1}));
}

TEST_F(CanBus, NeutralComesWithWhatComesWithEverySetPoint) {
  Peer peer;
  Bus bus("vcan0", false);
  CommandSettings command = command_with_idle();
  command.keep_alive = {{frame_of(0x80, {}), 0}, {frame_of(0x700, {5}), 100'000'000}};
  command.arm = {{"closed loop", frame_of(0x07, {8}), {}, 0, 1}};
  CanActuator actuator(bus, command);
  bus.start();
  actuator.arm();
  EXPECT_THAT(peer.received(), testing::ElementsAre(float_frame(command_id, 0.0),
                                                    frame_of(0x80, {}), frame_of(0x07, {8})));
  actuator.release();
  EXPECT_THAT(peer.received(), testing::ElementsAre(float_frame(command_id, 0.0),
                                                    frame_of(0x80, {}), frame_of(0x07, {1})));
}

TEST_F(CanBus, ACommandThatIsNoNumberSendsNeutral) {
  Peer peer;
  Bus bus("vcan0", false);
  CanActuator actuator(bus, torque_command());
  bus.start();
  actuator.write(3.0);
  const Sample applied = actuator.write(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(applied.fault, Fault::range);
  EXPECT_EQ(applied.value, 0.0);
  EXPECT_EQ(peer.received().back(), float_frame(command_id, 0.0));
}

TEST_F(CanBus, KeepAliveFramesGoOutAtTheirPeriod) {
  Peer peer;
  Bus bus("vcan0", false);
  CommandSettings command = torque_command();
  command.keep_alive = {{frame_of(0x700, {5}), 100'000'000}};
  CanActuator actuator(bus, command);
  bus.start();
  int alive = 0;
  for (int tick = 0; tick < 1000; ++tick) {
    actuator.write(0.0);
    usleep(1000);
    for (const Frame& frame : peer.received()) alive += frame.id == 0x700 ? 1 : 0;
  }
  EXPECT_GE(alive, 10);
  EXPECT_LE(alive, 11);
}

CommandSettings command_that_expects(const char* name) {
  CommandSettings command = torque_command();
  Expectation answer;
  answer.pattern = pattern_of(0x585);
  answer.pattern.require_byte(0, 0x60);
  answer.refusal = pattern_of(0x585);
  answer.refusal->require_byte(0, 0x80);
  command.startup = {{name, frame_of(0x605, {0x2F, 0x60, 0x60, 0, 8, 0, 0, 0}), answer, 0, 2}};
  return command;
}

TEST_F(CanBus, ANeutralStepIsRepeatedUntilTheDeviceAnswersAsItMust) {
  int asked = 0;
  AnsweringPeer device([&](const Frame& frame) -> std::vector<Frame> {
    if (frame.id != command_id) return {};
    return {frame_of(0x585, {static_cast<std::uint8_t>(++asked < 4 ? 0x00 : 0x0A)})};
  });
  Bus bus("vcan0", false);
  CommandSettings command = torque_command();
  command.keep_alive = {{frame_of(0x80, {}), 0}};
  Step neutral;
  neutral.name = "torque 0";
  neutral.neutral = true;
  neutral.expect.emplace();
  neutral.expect->pattern = pattern_of(0x585, 1);
  neutral.expect->pattern.require_byte(0, 0x0A);
  neutral.expect->timeout_ns = 20'000'000;
  neutral.repeats = 50;
  command.arm = {neutral};
  HealthRule mode;
  mode.pattern = pattern_of(0x585, 1);
  mode.signal = byte_at(0);
  mode.value = 10.0;
  command.health = {mode};
  CanActuator actuator(bus, command);
  bus.start();
  Peer peer;
  actuator.arm();
  EXPECT_EQ(actuator.write(0.0).fault, Fault::none) << actuator.reason();
  const std::vector<Frame> seen = peer.received();
  ASSERT_GE(seen.size(), 4u);
  std::vector<std::uint32_t> sent;
  for (const Frame& frame : seen)
    if (frame.id != 0x585) sent.push_back(frame.id);
  for (std::size_t n = 0; n < sent.size(); ++n)
    EXPECT_EQ(sent[n], n % 2 == 0 ? command_id : 0x80u) << "a SYNC with every one";
}

TEST_F(CanBus, AStartUpStepGoesOnWhenItIsAnswered) {
  AnsweringPeer device([](const Frame& frame) -> std::vector<Frame> {
    if (frame.id != 0x605) return {};
    return {frame_of(0x585, {0x60, 0x60, 0x60, 0, 0, 0, 0, 0})};
  });
  Bus bus("vcan0", false);
  CanActuator actuator(bus, command_that_expects("mode of operation"));
  bus.start();
  EXPECT_NO_THROW(actuator.start());
}

TEST_F(CanBus, AStartUpStepThatIsRefusedSaysWhatTheDeviceSaid) {
  AnsweringPeer device([](const Frame& frame) -> std::vector<Frame> {
    if (frame.id != 0x605) return {};
    return {frame_of(0x585, {0x80, 0x60, 0x60, 0, 0x30, 0, 9, 6})};
  });
  Bus bus("vcan0", false);
  CanActuator actuator(bus, command_that_expects("mode of operation"));
  bus.start();
  EXPECT_THAT(refusal_of([&] { actuator.start(); }),
              HasSubstr("vcan0: start-up step 'mode of operation' was refused by the device: "
                        "80 60 60 00 30 00 09 06"));
}

TEST_F(CanBus, AStartUpStepWithoutAnswerSaysWhatWasWaitedFor) {
  Peer peer;
  Bus bus("vcan0", false);
  CanActuator actuator(bus, command_that_expects("mode of operation"));
  bus.start();
  EXPECT_THAT(refusal_of([&] { actuator.start(); }),
              HasSubstr("step 'mode of operation' was not answered with 0x585 within 500 ms"));
  EXPECT_EQ(peer.received().size(), 2u) << "the step may be repeated once";
}

TEST_F(CanBus, AnOldAnswerIsNotTakenForTheNewOne) {
  Peer peer;
  Bus bus("vcan0", false);
  CanActuator actuator(bus, command_that_expects("mode of operation"));
  bus.start();
  peer.send(frame_of(0x585, {0x60, 0x60, 0x60, 0, 0, 0, 0, 0}));
  EXPECT_THROW(actuator.start(), std::runtime_error);
}

// A list may wait for a minute, for a homing say: for an answer, or by a delay.
TEST_F(CanBus, AStopWhileADeviceIsArmedEndsTheWaitDisarmsAndBeginsNoFurtherStep) {
  constexpr std::int64_t an_hour_ns = 3'600'000'000'000;
  for (const bool delay : {true, false}) {
    RunControl control;
    Peer peer;
    const AnsweringPeer device([&](const Frame& frame) -> std::vector<Frame> {
      if (frame.id == 0x0A) control.stop_requests = 1;
      return {};
    });
    Bus bus("vcan0", false, Waiting{control});
    CommandSettings command = torque_command();
    Step home{"home", frame_of(0x0A, {1}), {}, 0, 1};
    if (delay) {
      home.delay_ns = an_hour_ns;
    } else {
      home.expect.emplace();
      home.expect->pattern = pattern_of(0x585);
      home.expect->timeout_ns = an_hour_ns;
    }
    command.arm = {home, {"enable", frame_of(0x0B, {1}), {}, 0, 1}};
    command.disarm = {{"idle", frame_of(0x07, {1}), {}, 0, 1}};
    CanActuator actuator(bus, command);
    bus.start();
    EXPECT_THROW(actuator.arm(), StopRequested);
    EXPECT_TRUE(actuator.released());
    const std::vector<Frame> seen = peer.received();
    ASSERT_FALSE(seen.empty());
    EXPECT_EQ(seen.back(), frame_of(0x07, {1}));
    EXPECT_FALSE(std::ranges::any_of(seen, [](const Frame& frame) { return frame.id == 0x0B; }));
  }
}

TEST_F(CanBus, ListsOnTheWayOutAreProgressAndNotCutShort) {
  RunControl control;
  control.stop_requests = 2;
  Peer peer;
  Bus bus("vcan0", false, Waiting{control});
  CommandSettings command = torque_command();
  command.disarm = {{"brake", frame_of(0x07, {1}), {}, 5'000'000'000, 1},
                    {"idle", frame_of(0x08, {1}), {}, 0, 1}};
  CanActuator actuator(bus, command);
  bus.start();
  actuator.write(0.0);
  actuator.release();
  EXPECT_TRUE(actuator.released());
  EXPECT_GE(control.progress(), 100U) << "5 s, turn by turn";
}

TEST_F(CanBus, ADeviceThatFailsToArmIsDisarmed) {
  Peer peer;
  Bus bus("vcan0", false);
  CommandSettings command = command_that_expects("closed loop");
  std::swap(command.arm, command.startup);
  command.disarm = {{"idle", frame_of(0x07, {1}), {}, 0, 1}};
  CanActuator actuator(bus, command);
  bus.start();
  EXPECT_THROW(actuator.arm(), std::runtime_error);
  EXPECT_EQ(peer.received().back(), frame_of(0x07, {1}));
}

CommandSettings command_with_health() {
  CommandSettings command = torque_command();
  HealthRule state;
  state.name = "axis_state";
  state.pattern = pattern_of(0x01);
  state.signal = byte_at(4);
  state.value = 8.0;
  state.max_age_ns = 250'000'000;
  command.health = {state};
  return command;
}

TEST_F(CanBus, AnUnhealthyDeviceIsAFaultWithAReason) {
  Peer peer;
  Bus bus("vcan0", false);
  CanActuator actuator(bus, command_with_health());
  bus.start();
  actuator.arm();
  EXPECT_EQ(actuator.write(1.0).fault, Fault::none) << "nothing is known yet";
  peer.send(frame_of(0x01, {0, 0, 0, 0, 8, 0, 0, 0}));
  EXPECT_EQ(actuator.write(1.0).fault, Fault::none);
  peer.send(frame_of(0x01, {0, 0, 0, 0, 1, 0, 0, 0}));
  EXPECT_EQ(actuator.write(1.0).fault, Fault::device);
  EXPECT_THAT(actuator.reason(), HasSubstr("axis_state is 1, must be = 8"));
}

TEST_F(CanBus, AHeartbeatThatStopsIsAFault) {
  Peer peer;
  Bus bus("vcan0", false);
  CanActuator actuator(bus, command_with_health());
  bus.start();
  actuator.arm();
  for (int tick = 0; tick < 10; ++tick) {
    peer.send(frame_of(0x01, {0, 0, 0, 0, 8, 0, 0, 0}));
    usleep(100'000);
    ASSERT_EQ(actuator.write(1.0).fault, Fault::none);
  }
  usleep(200'000);
  EXPECT_EQ(actuator.write(1.0).fault, Fault::device);
  EXPECT_THAT(actuator.reason(), HasSubstr("older than allowed"));
}

// The sweep file is made between arming and the first tick; nobody reads meanwhile, and a device
// that answers set-points has none to answer.
TEST_F(CanBus, TheTimeBetweenArmingAndTheFirstSetPointIsNoSilence) {
  Peer peer;
  Bus bus("vcan0", false);
  CanActuator actuator(bus, command_with_health());
  bus.start();
  for (int round = 0; round < 2; ++round) {
    actuator.arm();
    peer.send(frame_of(0x01, {0, 0, 0, 0, 8, 0, 0, 0}));
    usleep(900'000);
    EXPECT_EQ(actuator.write(1.0).fault, Fault::none) << actuator.reason();
    usleep(200'000);
    EXPECT_EQ(actuator.write(1.0).fault, Fault::none) << actuator.reason();
    usleep(200'000);
    EXPECT_EQ(actuator.write(1.0).fault, Fault::device) << "it stays silent";
    actuator.release();
  }
  actuator.arm();
  peer.send(frame_of(0x01, {0, 0, 0, 0, 1, 0, 0, 0}));
  usleep(900'000);
  EXPECT_EQ(actuator.write(1.0).fault, Fault::device) << "what it said meanwhile counts";
}

TEST_F(CanBus, SilenceBecomesATimeOut) {
  Peer peer;
  Bus bus("vcan0", false);
  FeedbackSettings feedback = position_feedback();
  feedback.timeout_ns = 20'000'000;
  CanSensor sensor(bus, feedback);
  bus.start();
  peer.send(float_frame(feedback_id, 1.0));
  EXPECT_EQ(sensor.read().fault, Fault::none);
  usleep(15'000);
  EXPECT_EQ(sensor.read().fault, Fault::stale);
  usleep(15'000);
  EXPECT_EQ(sensor.read().fault, Fault::timeout);
  peer.send(float_frame(feedback_id, 2.0));
  EXPECT_EQ(sensor.read().fault, Fault::none);
}

TEST_F(CanBus, AWrongChecksumIsABusFaultAndItsValueIsNotBelieved) {
  Peer peer;
  Bus bus("vcan0", false);
  FeedbackSettings feedback = position_feedback();
  feedback.checksum = {Checksum::Kind::sum8, 7, 0, 6, true};
  CanSensor sensor(bus, feedback);
  bus.start();
  Frame good = float_frame(feedback_id, 1.0);
  seal(good, feedback.checksum);
  peer.send(good);
  EXPECT_EQ(sensor.read().value, 1.0);
  Frame bad = float_frame(feedback_id, 9.0);
  seal(bad, feedback.checksum);
  ++bad.data[7];
  peer.send(bad);
  const Sample sample = sensor.read();
  EXPECT_EQ(sample.fault, Fault::bus);
  EXPECT_EQ(sample.value, 1.0);
  EXPECT_EQ(sensor.read().fault, Fault::stale);
  EXPECT_EQ(bus.counters().bad_checksums, 1u);
}

TEST_F(CanBus, WhatTheDeviceCallsInvalidIsOutOfRange) {
  Peer peer;
  Bus bus("vcan0", false);
  FeedbackSettings feedback = position_feedback();
  feedback.signal = byte_at(0);
  feedback.signal.encoding = Encoding::signed_integer;
  feedback.invalid_raw = 0x80;
  CanSensor integer(bus, feedback);
  FeedbackSettings number = position_feedback();
  number.signal = float_at(32);
  CanSensor real(bus, number);
  bus.start();
  peer.send(frame_of(feedback_id, {0x7F, 0, 0, 0, 0, 0, 0x80, 0x3F}));
  EXPECT_EQ(integer.read().value, 127.0);
  EXPECT_EQ(real.read().value, 1.0);
  peer.send(frame_of(feedback_id, {0x80, 0, 0, 0, 0, 0, 0xC0, 0x7F}));
  EXPECT_EQ(integer.read().fault, Fault::range);
  const Sample not_a_number = real.read();
  EXPECT_EQ(not_a_number.fault, Fault::range);
  EXPECT_EQ(not_a_number.value, 1.0);
}

TEST_F(CanBus, AWrappingAngleIsContinuous) {
  Peer peer;
  Bus bus("vcan0", false);
  FeedbackSettings feedback = position_feedback();
  feedback.signal = byte_at(0);
  feedback.signal.wrap_modulus = 256.0;
  CanSensor sensor(bus, feedback);
  bus.start();
  for (int count = 200; count < 2000; count += 50) {
    peer.send(frame_of(feedback_id, {static_cast<std::uint8_t>(count), 0, 0, 0, 0, 0, 0, 0}));
    ASSERT_EQ(sensor.read().value, count);
  }
}

TEST_F(CanBus, APolledSensorAsksAtEveryRead) {
  AnsweringPeer device([](const Frame& frame) -> std::vector<Frame> {
    if (!frame.remote || frame.id != feedback_id) return {};
    return {float_frame(feedback_id, 42.0)};
  });
  Bus bus("vcan0", false);
  FeedbackSettings feedback = position_feedback();
  feedback.polls = {frame_of(feedback_id, {}), frame_of(0x055, {1})};
  feedback.polls.front().remote = true;
  CanSensor sensor(bus, feedback);
  bus.start();
  EXPECT_EQ(sensor.read().fault, Fault::stale);
  usleep(1000);
  EXPECT_EQ(sensor.read().value, 42.0);
}

TEST_F(CanBus, OpeningSaysWhatIsMissingAndWhatToDo) {
  EXPECT_THAT(refusal_of([] { Bus bus("can7", false); }),
              HasSubstr("CAN interface can7 is not there; `ip -brief link` lists"));
  EXPECT_THAT(refusal_of([] { Bus bus("lo", false); }), HasSubstr("lo is no CAN interface"));
  EXPECT_THAT(refusal_of([] { Bus bus("a-very-long-name", false); }),
              HasSubstr("1 to 15 characters"));
  shell("ip link set vcan0 down");
  EXPECT_THAT(refusal_of([] { Bus bus("vcan0", false); }),
              HasSubstr("vcan0 is down; `ip link set vcan0 up type can bitrate"));
  shell("ip link set vcan0 mtu 16 && ip link set vcan0 up");
  EXPECT_THAT(refusal_of([] { Bus bus("vcan0", true); }),
              HasSubstr("carries classic frames only, the rig sends CAN-FD"));
}

// As that of a controller in bus-off is; here because the other end of the wire is down.
TEST_F(CanBus, AnInterfaceWithoutACarrierIsRefused) {
  std::system("ip link del can8 2>/dev/null");
  shell("ip link add can8 type vxcan peer name can9 && ip link set can8 up");
  EXPECT_THAT(refusal_of([] { Bus bus("can8", false); }),
              HasSubstr("can8 is up but has no carrier: its controller is bus-off? `ip -details "
                        "link show can8` tells; `ip link set can8 down`, then `ip link set can8 up "
                        "type can restart-ms 100` starts it again, and after every bus-off"));
  shell("ip link set can9 up");
  EXPECT_EQ(refusal_of([] { Bus bus("can8", false); }), "");
  shell("ip link del can8");
}

}  // namespace
}  // namespace sinerig::can
