// Who switches the transmitter of a half-duplex line. The port is a pseudo-terminal, to which the
// kernel refuses both ways; where a test wants a port that has them, this program answers its ioctl
// calls itself and remembers them.
#include <cerrno>
#include <cstdarg>
#include <cstdlib>
#include <fcntl.h>
#include <termios.h>
#include <unistd.h>
#include <vector>

#include <gmock/gmock.h>
#include <linux/serial.h>
#include <sys/ioctl.h>
#include <sys/syscall.h>

#include "drivers/modbus/line_rates.h"
#include "drivers/modbus/transport.h"
#include "drivers/monotonic_time.h"

namespace {

struct Port {
  bool has_rs485 = false;
  bool has_rts = false;
  serial_rs485 rs485{};
  std::vector<bool> rts;  // as it was set, in order
  bool exclusive = false;
};
Port port;

}  // namespace

// In place of the C library's, for libmodbus too.
extern "C" int ioctl(int fd, unsigned long request, ...) noexcept {
  va_list list;
  va_start(list, request);
  void* const argument = va_arg(list, void*);
  va_end(list);
  if (port.has_rs485 && request == TIOCGRS485) {
    *static_cast<serial_rs485*>(argument) = port.rs485;
    return 0;
  }
  if (port.has_rs485 && request == TIOCSRS485) {
    port.rs485 = *static_cast<serial_rs485*>(argument);
    return 0;
  }
  if (port.has_rts && request == TIOCMGET) {
    *static_cast<int*>(argument) = 0;
    return 0;
  }
  if (port.has_rts && request == TIOCMSET) {
    port.rts.push_back((*static_cast<int*>(argument) & TIOCM_RTS) != 0);
    return 0;
  }
  if (port.has_rts && (request == TIOCEXCL || request == TIOCNXCL)) {
    port.exclusive = request == TIOCEXCL;
    return 0;
  }
  return static_cast<int>(syscall(SYS_ioctl, fd, request, argument));
}

namespace sinerig::modbus {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

class Rs485Port : public testing::Test {
 protected:
  void SetUp() override {
    port = {};
    master_ = posix_openpt(O_RDWR | O_NOCTTY);
    ASSERT_GE(master_, 0);
    ASSERT_EQ(grantpt(master_), 0);
    ASSERT_EQ(unlockpt(master_), 0);
    char name[128];
    ASSERT_EQ(ptsname_r(master_, name, sizeof name), 0);
    name_ = name;
  }
  void TearDown() override { close(master_); }

  ConnectionSettings settings(Rs485 rs485) const {
    ConnectionSettings settings;
    settings.name = "drive";
    settings.serial = true;
    settings.device = name_;
    settings.rs485 = rs485;
    return settings;
  }

  // A question that nobody answers.
  static void ask(Transport& transport) {
    Request question;
    question.read_count = 1;
    std::array<std::uint16_t, max_read_registers> registers{};
    const Answer answer = transport.ask(question, monotonic_now_ns() + 1'000'000, registers);
    EXPECT_EQ(answer.outcome, Outcome::timeout);
  }

  int master_ = -1;
  std::string name_;
};

TEST_F(Rs485Port, ThatHasNoSuchModeIsRefusedWithWhatToDo) {
  Transport transport{settings(Rs485::kernel)};
  EXPECT_THAT([&] { transport.connect(); },
              ThrowsMessage<std::runtime_error>(AllOf(
                  HasSubstr("[modbus.drive] " + name_ + ": this serial port has no RS-485 mode"),
                  HasSubstr("adapters that switch by themselves need rs485 = \"adapter\""))));
  EXPECT_FALSE(transport.connected());
}

TEST_F(Rs485Port, RunsAtEveryRateThatARigFileMaySayAndNoOther) {
  ConnectionSettings wanted = settings(Rs485::adapter);
  for (const LineRate& rate : line_rates) {
    wanted.baud = rate.baud;
    Transport transport{wanted};
    EXPECT_TRUE(transport.try_connect()) << rate.baud;
  }
  wanted.baud = 2'000'000;
  Transport transport{wanted};
  EXPECT_THAT([&] { transport.connect(); },
              ThrowsMessage<std::runtime_error>(HasSubstr("does not run at 2000000 baud")));
}

TEST_F(Rs485Port, ThatHasNoRtsIsRefusedWithWhatToDo) {
  for (const Rs485 way : {Rs485::rts_up, Rs485::rts_down}) {
    Transport transport{settings(way)};
    EXPECT_THAT([&] { transport.connect(); },
                ThrowsMessage<std::runtime_error>(AllOf(
                    HasSubstr("[modbus.drive] " + name_ + ": this serial port has no line RTS"),
                    HasSubstr("need rs485 = \"adapter\""))));
    EXPECT_FALSE(transport.connected());
  }
}

TEST_F(Rs485Port, IsSwitchedByTheKernelWhereItIsAskedTo) {
  port.has_rs485 = true;
  Transport transport{settings(Rs485::kernel)};
  transport.connect();
  EXPECT_TRUE(transport.connected());
  EXPECT_NE(port.rs485.flags & SER_RS485_ENABLED, 0U);
  EXPECT_THAT(port.rts, testing::IsEmpty());
}

TEST_F(Rs485Port, IsSwitchedByRtsForEachFrame) {
  for (const bool up : {true, false}) {
    port = {};
    port.has_rts = true;
    Transport transport{settings(up ? Rs485::rts_up : Rs485::rts_down)};
    transport.connect();
    EXPECT_THAT(port.rts, ElementsAre(!up)) << "it listens at first";
    ask(transport);
    EXPECT_THAT(port.rts, ElementsAre(!up, up, !up));
  }
}

TEST_F(Rs485Port, IsLeftAloneWhereTheAdapterSwitches) {
  port.has_rs485 = port.has_rts = true;
  Transport transport{settings(Rs485::adapter)};
  transport.connect();
  ask(transport);
  EXPECT_EQ(port.rs485.flags & SER_RS485_ENABLED, 0U);
  EXPECT_THAT(port.rts, testing::IsEmpty());
}

// Two that ask on one line take each other's answers.
TEST_F(Rs485Port, IsOfOneTransportAtATime) {
  Transport first{settings(Rs485::adapter)};
  first.connect();
  Transport second{settings(Rs485::adapter)};
  EXPECT_THAT([&] { second.connect(); },
              ThrowsMessage<std::runtime_error>(HasSubstr(
                  "[modbus.drive] " + name_ + ": another program has this serial port open")));
  EXPECT_FALSE(second.connected());
  EXPECT_TRUE(first.try_connect()) << "again, after a fault";
  first.disconnect();
  EXPECT_TRUE(second.try_connect());
}

// A pseudo-terminal would stay closed to everybody after a crash.
TEST_F(Rs485Port, IsClosedToProgramsThatKnowNothingOfTheLockWhereItIsARealOne) {
  port.has_rts = true;
  Transport transport{settings(Rs485::adapter)};
  transport.connect();
  EXPECT_TRUE(port.exclusive);
  transport.disconnect();
  EXPECT_FALSE(port.exclusive);
}

}  // namespace
}  // namespace sinerig::modbus
