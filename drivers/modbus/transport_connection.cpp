// How a connection is made and ended; transport.cpp asks and waits on it.
#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <netdb.h>
#include <stdexcept>
#include <unistd.h>
#include <utility>
#include <vector>

#include <modbus/modbus.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include "drivers/modbus/line_rates.h"
#include "drivers/modbus/transport.h"

namespace sinerig::modbus {
namespace {

constexpr std::uint32_t connect_timeout_us = 300'000;

// What a close does with bytes that are still to be delivered: dropped with the connection (RST),
// or sent on by the kernel. Set from the beginning: it holds for a process that is killed, too.
void drop_what_waits(int socket, bool drop) noexcept {
  const linger how{.l_onoff = drop ? 1 : 0, .l_linger = 0};
  setsockopt(socket, SOL_SOCKET, SO_LINGER, &how, sizeof how);
}

// Numbers only: a look-up may take seconds, and connections are made again between two ticks. Empty
// where the name is not known.
std::vector<std::string> addresses_of(const std::string& host) {
  const addrinfo wanted{.ai_flags = AI_ADDRCONFIG,
                        .ai_family = AF_UNSPEC,
                        .ai_socktype = SOCK_STREAM,
                        .ai_protocol = 0,
                        .ai_addrlen = 0,
                        .ai_addr = nullptr,
                        .ai_canonname = nullptr,
                        .ai_next = nullptr};
  addrinfo* found = nullptr;
  if (getaddrinfo(host.c_str(), nullptr, &wanted, &found) != 0) return {};
  std::vector<std::string> addresses;
  for (const addrinfo* one = found; one != nullptr; one = one->ai_next) {
    char text[NI_MAXHOST];
    if (getnameinfo(one->ai_addr, one->ai_addrlen, text, sizeof text, nullptr, 0, NI_NUMERICHOST) ==
        0)
      addresses.emplace_back(text);
  }
  freeaddrinfo(found);
  return addresses;
}

}  // namespace

void Transport::Close::operator()(modbus_t* context) const noexcept {
  modbus_close(context);
  modbus_free(context);
}

Transport::Transport(ConnectionSettings settings) : settings_{std::move(settings)} {}

Transport::~Transport() {
  disconnect();
}

int Transport::socket() const noexcept {
  return modbus_get_socket(context_.get());
}

void Transport::disconnect() noexcept {
  if (connected_ && !settings_.serial && transaction_ == answered_)
    drop_what_waits(socket(), false);
  give_up();
}

// libmodbus would say good-bye first, in good order behind what waits.
void Transport::give_up() noexcept {
  if (connected_ && !settings_.serial) {
    close(socket());
    modbus_set_socket(context_.get(), -1);
  }
  if (connected_ && settings_.serial) keep_others_out(false);
  context_.reset();
  leave_port();
  connected_ = false;
}

// False, and errno, where another program has the line: two that ask on one line take each other's
// answers. A lock goes with its process, however that ends, and holds for root; before libmodbus
// sets the line's rate.
bool Transport::take_port() noexcept {
  port_ = open(settings_.device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (port_ < 0) return false;
  if (flock(port_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return true;
  leave_port();
  errno = EBUSY;
  return false;
}

void Transport::leave_port() noexcept {
  if (port_ >= 0) close(port_);
  port_ = -1;
}

// Programs that know nothing of the lock. A pseudo-terminal would stay closed to everybody after a
// crash: its other end outlives that.
void Transport::keep_others_out(bool out) const noexcept {
  int lines = 0;
  if (ioctl(socket(), TIOCMGET, &lines) == 0) ioctl(socket(), out ? TIOCEXCL : TIOCNXCL);
}

bool Transport::try_connect() noexcept {
  disconnect();
  if (settings_.serial) {
    if (!take_port()) return false;
    context_.reset(modbus_new_rtu(settings_.device.c_str(), settings_.baud, settings_.parity, 8,
                                  settings_.stop_bits));
  } else {
    context_.reset(modbus_new_tcp_pi(found_host_.c_str(), std::to_string(settings_.port).c_str()));
  }
  const auto failed = [&] {
    const int error = errno;
    give_up();
    errno = error;
    return false;
  };
  if (!context_) return failed();
  modbus_set_error_recovery(context_.get(), MODBUS_ERROR_RECOVERY_NONE);
  modbus_set_response_timeout(context_.get(), 0, connect_timeout_us);
  // Without a time-out between bytes the response time-out covers the whole answer.
  modbus_set_byte_timeout(context_.get(), 0, 0);
  if (modbus_connect(context_.get()) != 0) return failed();
  if (settings_.serial && (!runs_at_its_rate() || !switch_transmitter())) return failed();
  if (settings_.serial) keep_others_out(true);
  if (!settings_.serial) drop_what_waits(socket(), true);
  connected_ = true;
  answered_ = transaction_;
  writes_waiting_ = 0;
  late_.clear();
  stray_size_ = 0;
  ++counters_.connections;
  return true;
}

// False, and errno, where the port has another rate than it was told: nothing would be understood.
bool Transport::runs_at_its_rate() const noexcept {
  const auto* const rate = std::ranges::find(line_rates, settings_.baud, &LineRate::baud);
  termios port{};
  if (tcgetattr(socket(), &port) != 0) return false;
  errno = ERANGE;
  return rate != line_rates.end() && cfgetospeed(&port) == rate->speed &&
         cfgetispeed(&port) == rate->speed;
}

// False, and errno, where the port cannot switch it as the rig file says.
bool Transport::switch_transmitter() noexcept {
  if (settings_.rs485 == Rs485::adapter) return true;
  if (settings_.rs485 == Rs485::kernel)
    return modbus_rtu_set_serial_mode(context_.get(), MODBUS_RTU_RS485) == 0;
  // libmodbus does not look whether there is such a line: the transmitter would never be on.
  int lines = 0;
  if (ioctl(socket(), TIOCMGET, &lines) != 0) return false;
  const bool up = settings_.rs485 == Rs485::rts_up;
  return modbus_rtu_set_rts(context_.get(), up ? MODBUS_RTU_RTS_UP : MODBUS_RTU_RTS_DOWN) == 0;
}

void Transport::connect() {
  const std::string where = "[modbus." + settings_.name + "] " + settings_.address() + ": ";
  if (settings_.serial) {
    if (try_connect()) return;
  } else {
    const std::vector<std::string> addresses = addresses_of(settings_.host);
    if (addresses.empty())
      throw std::runtime_error(where + "nobody knows this host: is its name right?");
    for (const std::string& address : addresses) {
      found_host_ = address;
      if (try_connect()) return;
    }
  }
  const int error = errno;
  const std::string why = modbus_strerror(error);
  if (!settings_.serial)
    throw std::runtime_error(where + "no connection (" + why +
                             "): is the device on, are host and port right?");
  if (error == ERANGE)
    throw std::runtime_error(where + "this serial port does not run at " +
                             std::to_string(settings_.baud) + " baud");
  if (error == EBUSY)
    throw std::runtime_error(where +
                             "another program has this serial port open, a sweep or a check "
                             "perhaps; `fuser -v " +
                             settings_.device + "` tells which");
  const bool refused = error == ENOTTY || error == EINVAL;
  if (settings_.rs485 == Rs485::kernel && refused)
    throw std::runtime_error(where + "this serial port has no RS-485 mode (" + why +
                             "); adapters that switch by themselves need rs485 = \"adapter\"");
  if (settings_.rs485 != Rs485::adapter && refused)
    throw std::runtime_error(where + "this serial port has no line RTS (" + why +
                             "); adapters that switch by themselves need rs485 = \"adapter\"");
  throw std::runtime_error(where + "cannot be opened (" + why +
                           "): is the adapter plugged in, are you in the group dialout?");
}

}  // namespace sinerig::modbus
