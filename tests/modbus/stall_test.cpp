// A drive that stops reading for a while, its system still taking connections and data for it: what
// was sent meanwhile is carried out when it goes on, however old it is.
#include <arpa/inet.h>
#include <atomic>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <netinet/in.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include <gmock/gmock.h>
#include <sys/socket.h>

#include "drivers/modbus/channels.h"
#include "drivers/monotonic_time.h"
#include "sim/modbus_drive/line.h"

namespace sinerig::modbus {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr std::int64_t generous_ns = 2'000'000'000;
constexpr std::size_t most_stale = 3;

sim::DriveSettings drive_settings() {
  sim::DriveSettings settings;
  settings.type = "float64";
  sim::MechanicalAxis axis;
  axis.inertia = 0.02;
  axis.damping = 0.5;
  axis.stiffness = 3.0;
  settings.system = sim::from_mechanical_axis(axis);
  return settings;
}

Place number_at(std::uint16_t address) {
  return {.address = address, .format = {.type = RegisterType::float64}};
}

// Reads, and answers, only while it is not held.
class HeldDrive {
 public:
  HeldDrive() : line_{sim::make_tcp_line(settings_)}, drive_{settings_, monotonic_now_ns()} {
    thread_ = std::thread{[this] {
      serve();
    }};
  }
  ~HeldDrive() {
    let_go();
    end_.store(true);
    thread_.join();
  }

  int port() const {
    const std::string address = line_->address();
    return std::stoi(address.substr(address.rfind(':') + 1));
  }
  // Returns when it reads no more.
  void hold() {
    std::unique_lock lock{mutex_};
    wanted_held_ = true;
    changed_.wait(lock, [&] { return held_; });
    writes_.clear();
  }
  void let_go() {
    const std::scoped_lock lock{mutex_};
    wanted_held_ = false;
    changed_.notify_all();
  }
  // Closes its end of every connection, as one that restarts; nobody is told when it is held.
  void drop() {
    const std::scoped_lock lock{mutex_};
    line_->drop();
  }

  struct Write {
    std::size_t address = 0;
    double value = 0.0;
  };
  // Since hold().
  std::vector<Write> writes() {
    const std::scoped_lock lock{mutex_};
    return writes_;
  }

 private:
  void serve() {
    while (!end_.load()) {
      std::unique_lock lock{mutex_};
      held_ = wanted_held_;
      changed_.notify_all();
      changed_.wait(lock, [&] { return !wanted_held_; });
      held_ = false;
      for (const sim::Frame& request : line_->receive()) {
        note(request.pdu);
        sim::Frame reply = request;
        reply.pdu = drive_.answer(request.pdu, monotonic_now_ns());
        line_->send(reply, false);
      }
      std::vector<pollfd> inputs = line_->inputs();
      lock.unlock();
      poll(inputs.data(), inputs.size(), 1);
    }
  }
  void note(const sim::Bytes& pdu) {
    const std::size_t header = pdu[0] == 16 ? 0 : pdu[0] == 23 ? 4 : pdu.size();
    if (header == pdu.size()) return;
    std::array<std::uint16_t, max_words> words{};
    const std::size_t count = pdu[header + 5] / 2U;
    for (std::size_t n = 0; n < count; ++n)
      words[n] =
          static_cast<std::uint16_t>(pdu[header + 6 + 2 * n] * 256 + pdu[header + 7 + 2 * n]);
    const Format format{.type = count == 4 ? RegisterType::float64 : RegisterType::uint16};
    writes_.push_back({.address = pdu[header + 1] * std::size_t{256} + pdu[header + 2],
                       .value = decode(words, format)});
  }

  sim::DriveSettings settings_ = drive_settings();
  std::mutex mutex_;
  std::condition_variable changed_;
  bool wanted_held_ = false;
  bool held_ = false;
  std::vector<Write> writes_;
  std::unique_ptr<sim::Line> line_;
  sim::Drive drive_;
  std::atomic<bool> end_{false};
  std::thread thread_;
};

Step enable(double value) {
  Step step;
  step.name = value == 0.0 ? "disable" : "enable";
  step.place = {.address = 0, .format = {}};
  step.write = value;
  return step;
}

LinkSettings to(const HeldDrive& drive) {
  LinkSettings settings;
  settings.connection.host = "127.0.0.1";
  settings.connection.port = drive.port();
  settings.period_ns = generous_ns;
  settings.response_timeout_ns = 20'000'000;
  return settings;
}

CommandSettings command() {
  CommandSettings made;
  made.place = number_at(16);
  made.arm = {enable(1.0)};
  made.disarm = {enable(0.0)};
  return made;
}

// The loop for that many exchanges. This one has no pace: a tick that replaced the order of the one
// before is none to end with.
void drive_on(Link& link, ModbusActuator& actuator, int exchanges) {
  for (int n = 0; n < exchanges; ++n) {
    actuator.write(1.0 + n);
    for (int turn = 0; !link.fresh() || link.overrun(); ++turn) {
      ASSERT_LT(turn, 100'000'000) << link.last_failure();
      std::this_thread::yield();
      actuator.write(1.0 + n);
    }
  }
}

// Of a drive that is armed and gets its set-points; true: it is read, too.
class ModbusStall : public testing::TestWithParam<bool> {
 protected:
  void begin(const CommandSettings& settings) {
    actuator_.emplace(link_, settings);
    if (GetParam())
      sensor_.emplace(link_, FeedbackSettings{number_at(34)}, "[sensor.position]", true);
    link_.open();
    actuator_->start();
    actuator_->arm();
    drive_on(link_, *actuator_, 5);
  }

  HeldDrive drive_;
  Link link_{to(drive_)};
  std::optional<ModbusActuator> actuator_;
  std::optional<ModbusSensor> sensor_;
};

TEST_P(ModbusStall, LeavesFewSetPointsAndNoOrderToSwitchOnForADriveThatGoesOn) {
  begin(command());

  drive_.hold();
  drive_on(link_, *actuator_, 25);
  actuator_->release();
  EXPECT_FALSE(actuator_->released());
  EXPECT_THAT(actuator_->not_released(),
              AllOf(HasSubstr("has not taken neutral"), HasSubstr("no answer in time")));
  link_.reconnect();
  EXPECT_THAT([&] { actuator_->arm(); },
              ThrowsMessage<std::runtime_error>(AllOf(HasSubstr("neutral, before it is armed: "),
                                                      HasSubstr("no answer in time"))));
  drive_.let_go();
  while (!actuator_->released()) actuator_->release();

  std::size_t stale = 0;
  for (const auto& [address, value] : drive_.writes()) {
    if (address == 0) {
      EXPECT_EQ(value, 0.0) << "switched on by what had waited";
    }
    if (address == 16 && value != 0.0) ++stale;
  }
  EXPECT_LE(stale, most_stale);
  actuator_->arm();
  drive_on(link_, *actuator_, 5);
  EXPECT_EQ(link_.newest().fate, CommandFate::confirmed);
  EXPECT_NE(link_.last_failure(), "");
  EXPECT_EQ(actuator_->reason(), "") << "what has failed before is not what is wrong now";
}

// Its age is what ends a sweep, and what it is asked before it gets set-points again moves nothing:
// the sine may be far from neutral.
TEST_P(ModbusStall, IsNoFaultBeforeItIsTooOldAndNoNeutral) {
  CommandSettings settings = command();
  settings.max_age_ns = 100 * generous_ns;
  begin(settings);

  drive_.hold();
  while (!link_.silent()) {
    actuator_->write(1.0);
    std::this_thread::yield();
  }
  for (int n = 0; n < 1000; ++n) {
    const Fault fault = actuator_->write(1.0).fault;
    ASSERT_TRUE(fault == Fault::none || fault == Fault::stale) << to_string(fault);
    std::this_thread::yield();
  }
  drive_.let_go();
  while (link_.silent() || link_.newest().fate != CommandFate::confirmed) {
    actuator_->write(1.0);
    std::this_thread::yield();
  }
  for (const auto& [address, value] : drive_.writes()) {
    if (address == 16) {
      EXPECT_NE(value, 0.0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Of, ModbusStall, testing::Values(false, true), [](const auto& of) {
  return of.param ? "ADriveThatIsRead" : "ADriveThatIsOnlyWritten";
});

// The end of a connection as the other side sees it: what was sent on it, then how it ended.
class Peer {
 public:
  Peer() : listener_{socket(AF_INET, SOCK_STREAM, 0)} {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(bind(listener_, reinterpret_cast<const sockaddr*>(&address), size), 0);
    EXPECT_EQ(listen(listener_, 4), 0);
    getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
  }
  ~Peer() {
    close(connection_);
    close(listener_);
  }
  int port() const { return port_; }
  void accept_one() { connection_ = accept(listener_, nullptr, nullptr); }
  // Of a connection that has ended: 0, or what was wrong with it.
  int how_it_ended() const {
    char bytes[4096];
    ssize_t count = 1;
    while (count > 0) count = read(connection_, bytes, sizeof bytes);
    return count == 0 ? 0 : errno;
  }
  void answer_one() const {
    std::uint8_t request[260];
    ASSERT_GT(read(connection_, request, sizeof request), 12);
    const std::uint8_t reply[] = {request[0], request[1], 0,           0,
                                  0,          6,          request[6],  16,
                                  request[8], request[9], request[10], request[11]};
    ASSERT_EQ(write(connection_, reply, sizeof reply), static_cast<ssize_t>(sizeof reply));
  }

 private:
  int listener_;
  int connection_ = -1;
  int port_ = 0;
};

Request set_point() {
  Request request;
  request.function = Function::write_multiple;
  request.write_address = 16;
  request.write_count = 1;
  return request;
}

TEST(ModbusGivenUp, AConnectionThatHoldsWritesIsResetAndAnOrdinaryOneIsNot) {
  for (const bool silent : {true, false}) {
    Peer peer;
    ConnectionSettings settings;
    settings.host = "127.0.0.1";
    settings.port = peer.port();
    Transport transport{settings};
    transport.connect();
    peer.accept_one();
    if (silent) {
      for (int n = 0; n < 3; ++n) {
        EXPECT_TRUE(transport.connected());
        transport.ask(set_point(), monotonic_now_ns() + 1'000'000, {});
      }
      EXPECT_FALSE(transport.connected());
    } else {
      std::thread device{[&] {
        peer.answer_one();
      }};
      EXPECT_EQ(transport.ask(set_point(), monotonic_now_ns() + generous_ns, {}).outcome,
                Outcome::ok);
      device.join();
      transport.disconnect();
    }
    EXPECT_EQ(peer.how_it_ended(), silent ? ECONNRESET : 0);
  }
}

// One that is closed, or whose process is killed, while an answer is still to come.
TEST(ModbusGivenUp, OneUnansweredWriteIsEnough) {
  Peer peer;
  {
    ConnectionSettings settings;
    settings.host = "127.0.0.1";
    settings.port = peer.port();
    Transport transport{settings};
    transport.connect();
    peer.accept_one();
    transport.ask(set_point(), monotonic_now_ns() + 1'000'000, {});
    EXPECT_TRUE(transport.connected());
  }
  EXPECT_EQ(peer.how_it_ended(), ECONNRESET);
}

// Its system answers for the connection that it had, once it is asked: too late for a try.
TEST(ModbusAgain, IsAlwaysANewConnection) {
  HeldDrive drive;
  Link link{to(drive)};
  ModbusActuator actuator{link, command()};
  link.open();
  actuator.start();
  actuator.arm();
  actuator.release();
  EXPECT_TRUE(actuator.released());
  const std::uint64_t before = link.counters().connections;
  drive.drop();
  link.reconnect();
  EXPECT_EQ(link.counters().connections, before + 1);
  actuator.start();
  actuator.arm();
}

}  // namespace
}  // namespace sinerig::modbus
