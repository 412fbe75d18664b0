// The driver against a simulated drive in this process, over loopback TCP and a pseudo-terminal, as
// fast as the exchanges go: no test waits for a time, each waits for an exchange.
#include <atomic>
#include <cmath>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <poll.h>
#include <sched.h>
#include <termios.h>
#include <thread>
#include <unistd.h>

#include <gmock/gmock.h>

#include "drivers/modbus/channels.h"
#include "drivers/monotonic_time.h"
#include "sim/modbus_drive/server.h"

namespace sinerig::modbus {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr std::int64_t generous_ns = 2'000'000'000;

std::string line_path() {
  return (std::filesystem::temp_directory_path() /
          ("sinerig-modbus-test-" + std::to_string(getpid())))
      .string();
}

sim::DriveSettings drive_settings(bool serial) {
  sim::DriveSettings settings;
  settings.serial = serial;
  settings.link = line_path();
  settings.baud = 1'000'000;
  settings.type = "float64";
  sim::MechanicalAxis axis;
  axis.inertia = 0.02;
  axis.damping = 0.5;
  axis.stiffness = 3.0;
  settings.system = sim::from_mechanical_axis(axis);
  return settings;
}

// A drive on its own thread for as long as this lives.
class RunningDrive {
 public:
  explicit RunningDrive(sim::DriveSettings settings)
      : server_{std::move(settings)}, thread_{[this] {
          server_.run(stop_, 1e9, 0.01);
        }} {}
  ~RunningDrive() { stop(); }
  void stop() {
    stop_.store(true);
    if (thread_.joinable()) thread_.join();
  }
  // When it was switched on and off, up to its end.
  std::string final_account() {
    stop();
    return server_.account();
  }
  int port() const {
    const std::string address = server_.address();
    return std::stoi(address.substr(address.rfind(':') + 1));
  }

 private:
  sim::DriveServer server_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

Place number_at(std::uint16_t address) {
  return {.unit = 1,
          .table = Table::holding,
          .address = address,
          .format = {.type = RegisterType::float64}};
}

Place word_at(std::uint16_t address) {
  return {.unit = 1, .table = Table::holding, .address = address, .format = {}};
}

struct Rig {
  explicit Rig(sim::DriveSettings drive_settings, const Waiting& waiting = {})
      : serial{drive_settings.serial},
        drive{std::move(drive_settings)},
        link{link_settings(), waiting} {}

  LinkSettings link_settings() const {
    LinkSettings to_drive;
    to_drive.connection.name = "drive";
    to_drive.connection.serial = serial;
    to_drive.connection.device = line_path();
    to_drive.connection.baud = 1'000'000;
    to_drive.connection.host = "127.0.0.1";
    to_drive.connection.port = serial ? 0 : drive.port();
    to_drive.period_ns = generous_ns;
    to_drive.response_timeout_ns = timeout_ns;
    to_drive.read_through = 8;  // one question for all
    return to_drive;
  }

  static Step write(const char* name, double value) {
    Step step;
    step.name = name;
    step.place = word_at(0);
    step.write = value;
    return step;
  }
  static Step expect_on() {
    Step step;
    step.name = "enabled";
    step.place = word_at(32);
    step.expect = Comparison{.sign = Comparison::Operator::equal, .value = 1.0};
    return step;
  }
  static CommandSettings command() {
    CommandSettings made;
    made.place = number_at(16);
    made.arm = {write("enable", 1.0), expect_on()};
    made.disarm = {write("disable", 0.0)};
    made.health = {{.name = "state",
                    .place = word_at(32),
                    .comparison = {.sign = Comparison::Operator::equal, .value = 1.0}}};
    return made;
  }

  void open() {
    actuator.emplace(link, settings);
    position.emplace(link, FeedbackSettings{number_at(34)}, "[sensor.position]", true);
    torque.emplace(link, FeedbackSettings{number_at(42)}, "[sensor.torque]", false);
    link.open();
    actuator->start();
  }

  // A tick when the exchange before has ended.
  Sample tick(double command) {
    Sample applied = actuator->write(command);
    while (applied.fault == Fault::stale && !link.fresh()) {
      std::this_thread::yield();
      applied = actuator->write(command);
    }
    return applied;
  }

  bool serial;
  std::int64_t timeout_ns = generous_ns / 2;
  CommandSettings settings = command();
  RunningDrive drive;
  Link link;
  std::optional<ModbusActuator> actuator;
  std::optional<ModbusSensor> position;
  std::optional<ModbusSensor> torque;
};

class ModbusLink : public testing::TestWithParam<bool> {};

TEST_P(ModbusLink, EveryExchangeTellsWhatItAppliedAndWhatItReadThen) {
  Rig rig{drive_settings(GetParam())};
  rig.open();
  rig.actuator->arm();
  std::int64_t last_ns = 0;
  int fresh = 0;
  for (int n = 1; fresh < 200; ++n) {
    // Orders that are replaced before they were taken up never go out: only what is reported did.
    const Sample applied = rig.actuator->write(1e-6 * n);
    const Sample torque = rig.torque->read();
    if (applied.fault != Fault::none) {
      std::this_thread::yield();
      continue;
    }
    ++fresh;
    ASSERT_EQ(torque.fault, Fault::none);
    ASSERT_EQ(torque.value, applied.value) << "read by the question that wrote it";
    ASSERT_EQ(torque.time_ns, applied.time_ns);
    ASSERT_GT(applied.time_ns, last_ns);
    ASSERT_LE(applied.time_ns, monotonic_now_ns());
    last_ns = applied.time_ns;
  }
  EXPECT_EQ(rig.actuator->reason(), "");
}

TEST_P(ModbusLink, IsReadWithoutACommandUntilItIsArmed) {
  Rig rig{drive_settings(GetParam())};
  rig.open();
  Sample position = rig.position->read();
  while (position.fault != Fault::none) {
    std::this_thread::yield();
    position = rig.position->read();
  }
  EXPECT_EQ(position.value, 0.0);
  EXPECT_EQ(rig.link.newest().fate, CommandFate::none);
}

TEST_P(ModbusLink, ReleaseWritesNeutralAndDisarmsWhateverWasHandedOver) {
  Rig rig{drive_settings(GetParam())};
  rig.open();
  rig.actuator->arm();
  while (rig.tick(3.0).value != 3.0) {
  }
  rig.actuator->write(4.0);
  rig.actuator->release();
  rig.actuator->release();
  const auto number = [&](const Place& place) {
    return rig.link.idle([&](Transport& transport) {
      std::array<std::uint16_t, max_words> registers{};
      Request question;
      question.read_address = place.address;
      question.read_count = static_cast<std::uint16_t>(place.words());
      transport.ask(question, monotonic_now_ns() + generous_ns, registers);
      return decode(registers, place.format);
    });
  };
  EXPECT_EQ(number(number_at(16)), 0.0);
  EXPECT_EQ(number(number_at(42)), 0.0);
  EXPECT_EQ(number(word_at(32)), 0.0);
}

// A list may wait for a minute, for a homing say; so may one that switches on again.
TEST_P(ModbusLink, AStopWhileItIsArmedEndsTheWaitDisarmsAndBeginsNoFurtherStep) {
  RunControl control;
  Rig rig{drive_settings(GetParam()), Waiting{control}};
  rig.settings = Rig::command();
  Step homed = Rig::expect_on();
  homed.expect->value = 77.0;
  homed.timeout_ns = 3'600'000'000'000;
  rig.settings.startup = {Rig::write("off", 0.0)};
  rig.settings.arm = {homed, Rig::write("enable", 1.0), Rig::expect_on()};
  rig.settings.disarm = {Rig::write("disable", 0.0)};
  rig.open();
  const std::uint64_t before = control.progress();
  std::thread someone{[&] {
    while (control.progress() < before + 5) std::this_thread::yield();
    control.stop_requests = 1;
  }};
  EXPECT_THROW(rig.actuator->arm(), StopRequested);
  someone.join();
  EXPECT_TRUE(rig.actuator->released());
  EXPECT_THROW(rig.actuator->start(), StopRequested);
  EXPECT_EQ(rig.drive.final_account(), "");
}

TEST_P(ModbusLink, ListsOnTheWayOutAreProgressAndNotCutShort) {
  RunControl control;
  Rig rig{drive_settings(GetParam()), Waiting{control}};
  rig.settings = Rig::command();
  rig.settings.disarm = {Rig::write("disable", 0.0), Rig::write("once more", 0.0)};
  rig.open();
  rig.actuator->arm();
  control.stop_requests = 2;
  const std::uint64_t before = control.progress();
  rig.actuator->release();
  EXPECT_TRUE(rig.actuator->released());
  EXPECT_GE(control.progress(), before + 2);
}

TEST_P(ModbusLink, AStopWhileItIsOpenedEndsThat) {
  RunControl control;
  control.stop_requests = 1;
  Rig rig{drive_settings(GetParam()), Waiting{control}};
  EXPECT_THROW(rig.open(), StopRequested);
}

// Writes or reads one number beside the driver.
double number_in(const RunningDrive& drive, const Place& place,
                 std::optional<double> written = {}) {
  ConnectionSettings connection;
  connection.host = "127.0.0.1";
  connection.port = drive.port();
  Transport transport{connection};
  transport.connect();
  const std::int64_t deadline_ns = monotonic_now_ns() + generous_ns;
  if (written) write_number(transport, place, *written, Writing::multiple, deadline_ns);
  std::array<std::uint16_t, max_words> registers{};
  Request question;
  question.read_address = place.address;
  question.read_count = static_cast<std::uint16_t>(place.words());
  EXPECT_EQ(transport.ask(question, deadline_ns, registers).outcome, Outcome::ok);
  return decode(registers, place.format);
}

TEST(ModbusRelease, ThatFindsNoConnectionIsTriedAgain) {
  sim::DriveSettings settings = drive_settings(false);
  auto drive = std::make_unique<RunningDrive>(settings);
  settings.port = drive->port();
  LinkSettings to_drive;
  to_drive.connection.host = "127.0.0.1";
  to_drive.connection.port = settings.port;
  to_drive.period_ns = generous_ns;
  to_drive.response_timeout_ns = generous_ns / 2;
  Link link{to_drive};
  CommandSettings command = Rig::command();
  ModbusActuator actuator{link, command};
  link.open();
  actuator.start();
  actuator.arm();
  const auto lose_the_drive_that_is_on = [&] {
    actuator.write(3.0);
    drive.reset();
    actuator.release();
    EXPECT_FALSE(actuator.released());
    drive = std::make_unique<RunningDrive>(settings);
    EXPECT_EQ(number_in(*drive, word_at(0), 1.0), 1.0);
    EXPECT_EQ(number_in(*drive, number_at(16), 3.0), 3.0);
  };
  const auto expect_released = [&] {
    EXPECT_EQ(number_in(*drive, word_at(32)), 0.0);
    EXPECT_EQ(number_in(*drive, number_at(16)), 0.0);
  };
  lose_the_drive_that_is_on();
  actuator.release();
  EXPECT_TRUE(actuator.released());
  expect_released();
  lose_the_drive_that_is_on();
  link.reconnect();
  actuator.start();
  expect_released();
}

// Released, and its lists written, by what its commands are written by.
TEST(ModbusRelease, OfADriveThatKnowsNoFunctionBut23) {
  sim::DriveSettings settings = drive_settings(false);
  settings.has_function_16 = false;
  Rig rig{settings};
  for (Sequence* list : {&rig.settings.arm, &rig.settings.disarm})
    for (Step& step : *list) step.writing = Writing::automatic;
  rig.open();
  rig.actuator->arm();
  while (rig.tick(3.0).value != 3.0) {
  }
  rig.actuator->release();
  EXPECT_TRUE(rig.actuator->released());
  EXPECT_EQ(rig.actuator->not_released(), "");
  EXPECT_EQ(number_in(rig.drive, number_at(16)), 0.0);
  EXPECT_EQ(number_in(rig.drive, word_at(32)), 0.0);
}

TEST(ModbusRelease, IsNotDoneWhileTheDeviceRefusesToBeDisarmed) {
  Rig rig{drive_settings(false)};
  CommandSettings command = Rig::command();
  command.disarm = {Rig::write("no such register", 0.0)};
  command.disarm.front().place.address = 1000;
  rig.actuator.emplace(rig.link, command);
  rig.link.open();
  rig.actuator->arm();
  rig.actuator->release();
  EXPECT_FALSE(rig.actuator->released());
  EXPECT_THAT(rig.actuator->not_released(),
              HasSubstr("has not taken all of its disarm list and may still be on: 127.0.0.1:"));
}

TEST(ModbusDeadline, NothingIsAskedWhenNobodyWaitsForTheAnswer) {
  sim::DriveSettings settings = drive_settings(false);
  settings.turn_around_ns = 50'000'000;
  const RunningDrive drive{settings};
  LinkSettings apart;
  apart.connection.host = "127.0.0.1";
  apart.connection.port = drive.port();
  apart.period_ns = generous_ns;
  apart.response_timeout_ns = 1'000'000;
  Link link{apart};
  link.watch(number_at(16), "[sensor.torque]");
  link.watch(number_at(34), "[sensor.position]");
  link.open();
  const std::uint64_t asked = link.counters().asked;
  link.tick(std::nullopt);
  while (link.pace().exchanges == 0) std::this_thread::yield();
  EXPECT_EQ(link.counters().asked, asked + 1);
  while (!link.fresh()) link.tick(std::nullopt);
  EXPECT_EQ(link.newest().fields[0].fault, Fault::timeout);
  EXPECT_EQ(link.newest().fields[1].fault, Fault::timeout);
}

// What was left of an exchange's time says nothing of how late an answer can be.
TEST(ModbusDeadline, ALateAnswerIsWaitedForByTheTimeOutThatIsConfigured) {
  sim::DriveSettings settings = drive_settings(true);
  settings.faults.lost_fraction = 1.0;
  const RunningDrive drive{settings};
  ConnectionSettings connection;
  connection.serial = true;
  connection.device = line_path();
  connection.baud = 1'000'000;
  Transport transport{connection};
  transport.set_usual_patience(generous_ns);
  transport.connect();
  Request question;
  question.read_address = 16;
  question.read_count = 4;
  std::array<std::uint16_t, max_words> registers{};
  const Answer hurried = transport.ask(question, monotonic_now_ns(), registers);
  EXPECT_EQ(hurried.outcome, Outcome::timeout);
  EXPECT_FALSE(hurried.withheld);
  EXPECT_TRUE(transport.ask(question, monotonic_now_ns() + 1'000'000, registers).withheld);
}

// What the thread has done by itself since the last tick.
void let_an_exchange_end(Rig& rig, std::size_t exchanges_before) {
  while (rig.link.pace().exchanges == exchanges_before) std::this_thread::yield();
}

TEST(ModbusLinkAgain, NothingOfBeforeAWaitIsFreshAfterIt) {
  Rig rig{drive_settings(false)};
  rig.open();
  rig.actuator->arm();
  std::size_t before = rig.link.pace().exchanges;
  rig.actuator->write(1.0);
  let_an_exchange_end(rig, before);
  rig.actuator->release();
  rig.actuator->start();
  rig.actuator->arm();
  EXPECT_EQ(rig.actuator->write(0.0).fault, Fault::stale);
  EXPECT_EQ(rig.position->read().fault, Fault::stale);

  rig.actuator->release();
  before = rig.link.pace().exchanges;
  rig.link.tick(std::nullopt);
  let_an_exchange_end(rig, before);
  rig.link.forget();
  rig.link.tick(std::nullopt);
  EXPECT_FALSE(rig.link.fresh());
}

TEST(ModbusLinkAgain, AgesBeginWithTheFirstTickNotWithArming) {
  Rig rig{drive_settings(false)};
  CommandSettings command = Rig::command();
  command.max_age_ns = 1;
  rig.actuator.emplace(rig.link, command);
  rig.link.open();
  rig.actuator->arm();
  EXPECT_EQ(rig.actuator->write(0.0).fault, Fault::stale) << rig.actuator->reason();
}

TEST_P(ModbusLink, ACommandThatIsNoNumberWritesNeutral) {
  Rig rig{drive_settings(GetParam())};
  rig.open();
  rig.actuator->arm();
  while (rig.tick(3.0).value != 3.0) {
  }
  const double none = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(rig.actuator->write(none).fault, Fault::range);
  while (rig.torque->read().value != 0.0) rig.tick(none);
}

TEST_P(ModbusLink, ADriveWithoutFunction23IsWrittenAndReadByTwoQuestions) {
  sim::DriveSettings settings = drive_settings(GetParam());
  settings.has_function_23 = false;
  Rig rig{settings};
  rig.open();
  rig.actuator->arm();
  EXPECT_EQ(rig.link.settings().writing, Writing::multiple);
  while (rig.tick(0.25).value != 0.25) {
  }
  EXPECT_EQ(rig.torque->read().value, 0.25);
}

TEST_P(ModbusLink, ATrippedDriveIsAFaultWithAReason) {
  sim::DriveSettings settings = drive_settings(GetParam());
  settings.faults.error_at_s = 1e-9;  // at the first turn: before it is armed
  Rig rig{settings};
  rig.open();
  EXPECT_THAT([&] { rig.actuator->arm(); },
              ThrowsMessage<std::runtime_error>(
                  HasSubstr("arm, enabled: register 32 is 2, must be = 1 within 0.5 s")));
}

TEST_P(ModbusLink, RefusesADriveThatMostlyRefuses) {
  sim::DriveSettings settings = drive_settings(GetParam());
  settings.faults.exception_fraction = 0.3;
  settings.faults.seed = 4;
  Rig rig{settings};
  rig.actuator.emplace(rig.link, [] {
    CommandSettings command;
    command.place = number_at(16);
    return command;
  }());
  rig.link.open();
  EXPECT_THAT([&] { rig.actuator->arm(); },
              ThrowsMessage<std::runtime_error>(HasSubstr("exception 4, device failure")));
}

// Two questions for each tick, and a drive that takes one too soon for the end of its own reply.
TEST(ModbusSilence, IsKeptBeforeEveryQuestion) {
  sim::DriveSettings settings = drive_settings(true);
  settings.silence_ns = 3'000'000;
  settings.has_function_23 = false;
  Rig rig{settings};
  LinkSettings patient = rig.link_settings();
  patient.connection.silence_ns = settings.silence_ns;
  Link link{patient};
  ModbusActuator actuator{link, Rig::command()};
  ModbusSensor position{link, FeedbackSettings{number_at(34)}, "[sensor.position]", true};
  link.open();
  actuator.start();
  actuator.arm();
  EXPECT_EQ(link.counters().timeouts, 0U);
  EXPECT_EQ(link.counters().late_answers, 0U);
}

// What is withheld while a late answer may come is no loss: on a serial line it is five times as
// much.
TEST_P(ModbusLink, TakesADriveThatLosesOneAnswerInFiftyAndNoneThatLosesOneInFour) {
  const auto lost = [&](double fraction) {
    sim::DriveSettings settings = drive_settings(GetParam());
    settings.faults.lost_fraction = fraction;
    settings.faults.seed = 3;
    Rig rig{settings};
    rig.link.watch(number_at(34), "[sensor.position]");
    rig.link.open();
    return obstacle(rig.link, rig.link.try_out(std::nullopt, 100));
  };
  EXPECT_EQ(lost(0.02), "");
  EXPECT_THAT(lost(0.25), HasSubstr("exchanges failed: "));
}

// Of two questions in an exchange, the second held back because the answer to the first may still
// come: that exchange has failed. A silent drive would be tried out for ever.
TEST_P(ModbusLink, AnExchangeThatLosesOneAnswerAndHoldsBackAnotherHasFailed) {
  sim::DriveSettings settings = drive_settings(GetParam());
  settings.faults.lost_fraction = 0.5;
  settings.faults.seed = 3;
  Rig rig{settings};
  LinkSettings apart = rig.link_settings();
  apart.read_through = 0;
  Link link{apart};
  link.watch(number_at(16), "[sensor.torque]");
  link.watch(number_at(34), "[sensor.position]");
  link.open();
  const Pace pace = link.try_out(std::nullopt, 8);
  EXPECT_EQ(pace.exchanges, 8U);
  // A question that is not asked after a lost answer draws no lot: on TCP another sequence of them.
  EXPECT_EQ(pace.failed, GetParam() ? 6U : 7U);
  EXPECT_THAT(obstacle(link, pace), HasSubstr("exchanges failed: "));
}

// The scheduling of the thread of that name in this process.
std::pair<int, int> policy_and_priority_of(const std::string& name) {
  for (const auto& task : std::filesystem::directory_iterator{"/proc/self/task"}) {
    std::ifstream comm{task.path() / "comm"};
    std::string found;
    std::getline(comm, found);
    if (found != name) continue;
    const pid_t id = std::stoi(task.path().filename().string());
    sched_param parameters{};
    sched_getparam(id, &parameters);
    return {sched_getscheduler(id), parameters.sched_priority};
  }
  return {-1, -1};
}

TEST(ModbusThread, RunsOnePriorityBelowTheLoop) {
  for (const int priority : {7, 1}) {
    const RunningDrive drive{drive_settings(false)};
    LinkSettings settings;
    settings.connection.host = "127.0.0.1";
    settings.connection.port = drive.port();
    settings.loop = realtime::Settings{.priority = priority};
    Link link{settings};
    link.watch(word_at(0), "[sensor.s]");
    link.open();
    ASSERT_TRUE(link.scheduling());
    const realtime::Grant& grant = *link.scheduling();
    const auto fifo = std::pair{SCHED_FIFO | SCHED_RESET_ON_FORK, priority - 1};
    EXPECT_EQ(policy_and_priority_of("sinerig-modbus"),
              grant.granted ? fifo : std::pair(SCHED_OTHER, 0))
        << grant.state;
    EXPECT_EQ(grant.remedy.empty(), grant.granted) << grant.state;
    if (priority == 1) {
      EXPECT_EQ(grant.remedy, "set [loop] priority to 2 or more");
    }
  }
}

TEST(ModbusThread, IsAnOrdinaryOneWhereNoLoopIsNamed) {
  const RunningDrive drive{drive_settings(false)};
  LinkSettings settings;
  settings.connection.host = "127.0.0.1";
  settings.connection.port = drive.port();
  Link link{settings};
  link.watch(word_at(0), "[sensor.s]");
  link.open();
  EXPECT_FALSE(link.scheduling());
  EXPECT_EQ(policy_and_priority_of("sinerig-modbus"), std::pair(SCHED_OTHER, 0));
}

INSTANTIATE_TEST_SUITE_P(Over, ModbusLink, testing::Values(false, true),
                         [](const auto& over) { return over.param ? "Rtu" : "Tcp"; });

TEST(ModbusPace, RefusesADeviceThatIsSlowerThanTheLoop) {
  sim::DriveSettings settings = drive_settings(false);
  settings.turn_around_ns = 3'000'000;
  Rig rig{settings};
  rig.open();
  const Pace pace = rig.link.try_out(std::nullopt, 10);
  EXPECT_EQ(obstacle(rig.link, pace), "");

  LinkSettings fast = rig.link_settings();
  fast.period_ns = 2'000'000;
  Link faster{fast};
  const Pace slow{.exchanges = 100, .failed = 0, .median_ns = 3'100'000, .slow_ns = 3'600'000};
  EXPECT_THAT(obstacle(faster, slow),
              HasSubstr("an exchange takes 3.1 ms, one in twenty more than 3.6 ms; the loop at 500 "
                        "Hz needs one every 2 ms: set [loop] rate_hz to 208 at most"));
  EXPECT_THAT([&] { require_pace(faster, slow); },
              ThrowsMessage<std::runtime_error>(HasSubstr("rate_hz")));
}

// What fits the period and not the time-out would be armed and then time out at every tick.
TEST(ModbusPace, RefusesADeviceThatIsSlowerThanItsTimeOut) {
  LinkSettings settings;
  const auto at_rate = [&](double rate_hz) {
    settings.period_ns = std::llround(1e9 / rate_hz);
    settings.response_timeout_ns = std::llround(usual_timeout * 1e9 / rate_hz);
    return std::make_unique<Link>(settings);
  };
  const Pace slow{.exchanges = 100, .failed = 0, .median_ns = 4'100'000, .slow_ns = 4'111'000};
  EXPECT_THAT(
      obstacle(*at_rate(200.0), slow),
      HasSubstr("the loop at 200 Hz needs one every 5 ms and gives it up after 3.75 ms: set [loop] "
                "rate_hz to 182 at most, or response_timeout_s to 0.00412 at least"));
  EXPECT_EQ(obstacle(*at_rate(182.0), slow), "");
  at_rate(200.0);
  settings.response_timeout_ns = 4'120'000;
  EXPECT_EQ(obstacle(Link{settings}, slow), "");
  settings.connection.silence_ns = 1'750'000;
  EXPECT_THAT(obstacle(Link{settings}, slow),
              HasSubstr("more than 4.11 ms, and 1.75 ms of silence; the loop at 200 Hz needs one "
                        "every 5 ms: set [loop] rate_hz to 153 at most"));
}

TEST(ModbusOpening, SaysWhichChannelAsksForARegisterThatIsNotThere) {
  Rig rig{drive_settings(false)};
  rig.link.watch(number_at(1000), "[sensor.angle]");
  EXPECT_THAT([&] { rig.link.open(); }, ThrowsMessage<std::runtime_error>(testing::AllOf(
                                            HasSubstr("[sensor.angle], register 1000 of unit 1"),
                                            HasSubstr("exception 2, illegal data address"))));
}

TEST(ModbusOpening, SaysThatNobodyListens) {
  int port = 0;
  {
    const RunningDrive gone{drive_settings(false)};
    port = gone.port();
  }
  LinkSettings settings;
  settings.connection.name = "drive";
  settings.connection.host = "127.0.0.1";
  settings.connection.port = port;
  Link link{settings};
  link.watch(word_at(0), "[sensor.s]");
  EXPECT_THAT([&] { link.open(); },
              ThrowsMessage<std::runtime_error>(testing::AllOf(
                  HasSubstr("[modbus.drive] 127.0.0.1:"), HasSubstr("are host and port right?"))));
}

TEST(ModbusOpening, FindsAnAdapterThatReturnsWhatIsSent) {
  for (const bool echo : {false, true}) {
    sim::DriveSettings settings = drive_settings(true);
    settings.echo = echo;
    Rig rig{settings};
    rig.open();
    const bool found = rig.link.idle([](Transport& transport) { return transport.echoes(); });
    EXPECT_EQ(found, echo);
    rig.actuator->arm();
    while (rig.tick(0.5).value != 0.5) {
    }
    EXPECT_EQ(rig.torque->read().value, 0.5);
  }
}

// Answers after their time-outs, one after the other too: none may be taken for that of another
// question, by its number, by its length, or because nothing is asked until it has come.
struct LateCase {
  const char* name;
  bool serial;
  std::uint16_t spare;
};

TEST(ModbusComparison, IsOfCodesAndNotOfTheLastBitOfTheirValues) {
  using Operator = Comparison::Operator;
  const Format tenths{.type = RegisterType::uint16, .scale = 0.1};
  const Format single{.type = RegisterType::float32};
  const auto holds = [](Operator sign, double value, double measured, const Format& format) {
    return Comparison{.sign = sign, .value = value}.holds(measured, format);
  };
  const std::array<std::uint16_t, 1> three{3};
  const double read = decode(three, tenths);
  ASSERT_NE(read, 0.3);
  for (const Operator sign : {Operator::equal, Operator::at_most, Operator::at_least})
    EXPECT_TRUE(holds(sign, 0.3, read, tenths));
  EXPECT_FALSE(holds(Operator::not_equal, 0.3, read, tenths));
  EXPECT_FALSE(holds(Operator::equal, 0.3, 0.4, tenths));
  EXPECT_TRUE(holds(Operator::not_equal, 0.3, 0.4, tenths));
  EXPECT_FALSE(holds(Operator::at_most, 0.3, 0.4, tenths));
  EXPECT_FALSE(holds(Operator::at_least, 0.3, 0.2, tenths));
  EXPECT_FALSE(holds(Operator::equal, 70000.0, 65535.0, {}));
  EXPECT_TRUE(holds(Operator::equal, 0.3, static_cast<double>(0.3F), single));
  EXPECT_FALSE(holds(Operator::equal, 0.3, 0.3001, single));
  const double none = std::numeric_limits<double>::quiet_NaN();
  for (const Operator sign :
       {Operator::equal, Operator::not_equal, Operator::at_most, Operator::at_least})
    EXPECT_FALSE(holds(sign, 0.0, none, single));
}

class ModbusLateAnswers : public testing::TestWithParam<LateCase> {};

TEST_P(ModbusLateAnswers, AreNeverTakenForAnother) {
  const auto& [name, serial, spare] = GetParam();
  for (const double fraction : {0.3, 1.0}) {
    sim::DriveSettings settings = drive_settings(serial);
    settings.faults.late_fraction = fraction;
    settings.faults.late_s = 0.012;
    const RunningDrive drive{settings};
    ConnectionSettings connection;
    connection.serial = serial;
    connection.device = line_path();
    connection.baud = 1'000'000;
    connection.host = "127.0.0.1";
    connection.port = serial ? 0 : drive.port();
    Transport transport{connection};
    // A busy machine keeps the drive from its answers for longer than five of these time-outs.
    transport.set_usual_patience(100'000'000);
    transport.connect();
    const Place place = number_at(16);
    int believed = 0;
    for (int n = 1; n <= 150; ++n) {
      if (!transport.connected()) transport.try_connect();
      Request question;
      question.function = Function::write_and_read;
      question.read_address = 16;
      question.read_count = static_cast<std::uint16_t>(4 + n % (spare + 1));
      question.write_address = 16;
      question.write_count = 4;
      const double sent = encode(question.words, place.format, n);
      std::array<std::uint16_t, max_read_registers> registers{};
      const Answer answer = transport.ask(question, monotonic_now_ns() + 10'000'000, registers);
      if (answer.outcome != Outcome::ok || answer.withheld) continue;
      ++believed;
      ASSERT_EQ(decode(registers, place.format), sent) << "question " << n;
    }
    EXPECT_GE(believed, fraction < 1.0 ? 10 : 0);
    EXPECT_GT(transport.counters().late_answers, 10U);
  }
}

// A serial device that says nothing to the first question until it is told to, and to every other
// what is the answer to that one, before its own where that is still to come.
class BelatedDevice {
 public:
  BelatedDevice() : line_{posix_openpt(O_RDWR | O_NOCTTY)} {
    grantpt(line_);
    unlockpt(line_);
    char name[128];
    EXPECT_EQ(ptsname_r(line_, name, sizeof name), 0);
    name_ = name;
    termios raw{};
    tcgetattr(line_, &raw);
    cfmakeraw(&raw);
    tcsetattr(line_, TCSANOW, &raw);
    thread_ = std::thread{[this] {
      serve();
    }};
  }
  ~BelatedDevice() {
    end_.store(true);
    thread_.join();
    close(line_);
  }
  const std::string& name() const { return name_; }
  void make_a_noise() { put({0x00}); }
  void answer_the_first() {
    while (!asked_.load()) std::this_thread::yield();
    answer(first_.exchange(0));
  }

 private:
  void serve() {
    std::size_t size = 0;
    std::uint16_t number = 0;
    while (!end_.load()) {
      pollfd input{.fd = line_, .events = POLLIN, .revents = 0};
      if (poll(&input, 1, 1) <= 0 || (input.revents & POLLIN) == 0) continue;
      std::uint8_t bytes[64];
      size += static_cast<std::size_t>(std::max<ssize_t>(0, read(line_, bytes, sizeof bytes)));
      for (; size >= 8; size -= 8) {
        if (++number == 1) {
          first_.store(1);
          asked_.store(true);
          continue;
        }
        answer_the_first();
        answer(number);
      }
    }
  }
  void answer(std::uint16_t value) {
    if (value == 0) return;
    std::vector<std::uint8_t> frame{1, 3, 2, 0, static_cast<std::uint8_t>(value)};
    const std::uint16_t sum = crc16(frame);
    frame.push_back(static_cast<std::uint8_t>(sum & 0xFFU));
    frame.push_back(static_cast<std::uint8_t>(sum >> 8U));
    put(frame);
  }
  void put(const std::vector<std::uint8_t>& bytes) const {
    EXPECT_EQ(write(line_, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }

  int line_;
  std::string name_;
  std::atomic<std::uint16_t> first_{0};
  std::atomic<bool> asked_{false};
  std::atomic<bool> end_{false};
  std::thread thread_;
};

TEST(ModbusLateAnswersOnALine, AreNotTakenForComeBecauseOfNoise) {
  BelatedDevice device;
  ConnectionSettings connection;
  connection.serial = true;
  connection.device = device.name();
  Transport transport{connection};
  transport.set_usual_patience(generous_ns);
  transport.connect();
  Request question;
  question.read_count = 1;
  std::array<std::uint16_t, max_words> registers{};
  const auto ask = [&](std::int64_t patience_ns) {
    return transport.ask(question, monotonic_now_ns() + patience_ns, registers);
  };
  EXPECT_EQ(ask(1'000'000).outcome, Outcome::timeout);
  device.make_a_noise();
  for (int n = 0; n < 100; ++n) {
    ASSERT_TRUE(ask(generous_ns).withheld) << "the answer to the first may be taken for it";
    std::this_thread::yield();
  }
  device.answer_the_first();
  Answer answer = ask(generous_ns);
  while (answer.withheld) answer = ask(generous_ns);
  EXPECT_EQ(answer.outcome, Outcome::ok);
  EXPECT_EQ(registers[0], 2U);
  EXPECT_EQ(transport.counters().late_answers, 1U);
}

INSTANTIATE_TEST_SUITE_P(ToldApart, ModbusLateAnswers,
                         testing::Values(LateCase{"ByNumber", false, 0},
                                         LateCase{"ByLength", true, 3},
                                         LateCase{"ByWaiting", true, 0}),
                         [](const auto& late) { return late.param.name; });

}  // namespace
}  // namespace sinerig::modbus
