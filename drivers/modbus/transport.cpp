#include "drivers/modbus/transport.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <poll.h>
#include <stdexcept>
#include <termios.h>
#include <unistd.h>
#include <utility>

#include <modbus/modbus.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include "drivers/monotonic_time.h"

namespace sinerig::modbus {
namespace {

constexpr std::size_t tcp_header_bytes = 7;
constexpr std::size_t crc_bytes = 2;
constexpr std::int64_t ns_per_s = 1'000'000'000;
constexpr std::uint32_t connect_timeout_us = 300'000;
constexpr std::int64_t echo_wait_ns = 300'000'000;
constexpr std::int64_t echo_quiet_ns = 50'000'000;

// An answer that is this many time-outs late is taken for lost.
constexpr std::int64_t latest_answer = 5;

// libmodbus takes a timeout of 0 for a mistake, and one of a second or more in two parts.
void set_response_timeout(modbus_t* context, std::int64_t timeout_ns) noexcept {
  const std::int64_t us = std::max<std::int64_t>(1, timeout_ns / 1000);
  modbus_set_response_timeout(context, static_cast<std::uint32_t>(us / 1'000'000),
                              static_cast<std::uint32_t>(us % 1'000'000));
}

bool wait_for_input(int fd, std::int64_t until_ns) noexcept {
  const std::int64_t left_ns = std::max<std::int64_t>(0, until_ns - monotonic_now_ns());
  const timespec left{.tv_sec = left_ns / ns_per_s, .tv_nsec = left_ns % ns_per_s};
  pollfd input{.fd = fd, .events = POLLIN, .revents = 0};
  return ppoll(&input, 1, &left, nullptr) > 0;
}

}  // namespace

void Transport::Close::operator()(modbus_t* context) const noexcept {
  modbus_close(context);
  modbus_free(context);
}

Transport::Transport(ConnectionSettings settings) : settings_{std::move(settings)} {}

Transport::~Transport() = default;

int Transport::socket() const noexcept {
  return modbus_get_socket(context_.get());
}

void Transport::disconnect() noexcept {
  context_.reset();
  connected_ = false;
}

bool Transport::try_connect() noexcept {
  disconnect();
  if (settings_.serial) {
    context_.reset(modbus_new_rtu(settings_.device.c_str(), settings_.baud, settings_.parity, 8,
                                  settings_.stop_bits));
  } else {
    context_.reset(
        modbus_new_tcp_pi(settings_.host.c_str(), std::to_string(settings_.port).c_str()));
  }
  if (!context_) return false;
  modbus_set_error_recovery(context_.get(), MODBUS_ERROR_RECOVERY_NONE);
  modbus_set_response_timeout(context_.get(), 0, connect_timeout_us);
  // Without a time-out between bytes the response time-out covers the whole answer.
  modbus_set_byte_timeout(context_.get(), 0, 0);
  if (modbus_connect(context_.get()) != 0) {
    const int error = errno;
    context_.reset();
    errno = error;
    return false;
  }
  if (settings_.serial && settings_.rs485 != Rs485::adapter) {
    const bool by_kernel = settings_.rs485 == Rs485::kernel;
    const int done = by_kernel ? modbus_rtu_set_serial_mode(context_.get(), MODBUS_RTU_RS485)
                               : modbus_rtu_set_rts(context_.get(), settings_.rs485 == Rs485::rts_up
                                                                        ? MODBUS_RTU_RTS_UP
                                                                        : MODBUS_RTU_RTS_DOWN);
    if (done != 0) {
      const int error = errno;
      context_.reset();
      errno = error;
      return false;
    }
  }
  connected_ = true;
  late_.fill({});
  ++counters_.connections;
  return true;
}

void Transport::connect() {
  if (try_connect()) return;
  const int error = errno;
  const std::string where = "[modbus." + settings_.name + "] " + settings_.address() + ": ";
  const std::string why = modbus_strerror(error);
  if (!settings_.serial)
    throw std::runtime_error(where + "no connection (" + why +
                             "): is the device on, are host and port right?");
  if (settings_.rs485 == Rs485::kernel && (error == ENOTTY || error == EINVAL))
    throw std::runtime_error(where + "this serial port has no RS-485 mode (" + why +
                             "); adapters that switch by themselves need rs485 = \"adapter\"");
  throw std::runtime_error(where + "cannot be opened (" + why +
                           "): is the adapter plugged in, are you in the group dialout?");
}

std::int64_t Transport::wire_ns(std::size_t bytes) const noexcept {
  if (!settings_.serial) return 0;
  const int bits = 9 + (settings_.parity == 'N' ? 0 : 1) + settings_.stop_bits;
  return static_cast<std::int64_t>(bytes) * bits * ns_per_s / settings_.baud;
}

int Transport::pending() const noexcept {
  int bytes = 0;
  return ioctl(socket(), FIONREAD, &bytes) == 0 ? bytes : 0;
}

void Transport::clear_input() noexcept {
  if (settings_.serial) {
    tcflush(socket(), TCIFLUSH);
  } else {
    modbus_flush(context_.get());
  }
}

void Transport::take_in_late_answers() noexcept {
  if (!settings_.serial || pending() == 0) return;
  clear_input();
  ++counters_.late_answers;
  const std::int64_t now_ns = monotonic_now_ns();
  const auto due = [&](const Late& late) {
    return late.until_ns > now_ns;
  };
  if (std::ranges::count_if(late_, due) == 1) late_.fill({});
}

bool Transport::could_be_mistaken(const Request& request) const noexcept {
  const std::int64_t now_ns = monotonic_now_ns();
  return request.reads() && std::ranges::any_of(late_, [&](const Late& late) {
           return late.until_ns > now_ns && late.size == reply_size(request) &&
                  late.function == static_cast<std::uint8_t>(request.function);
         });
}

void Transport::expect_late(const Request& request, std::int64_t until_ns) noexcept {
  Late& oldest = *std::ranges::min_element(late_, {}, &Late::until_ns);
  oldest = {.function = static_cast<std::uint8_t>(request.function),
            .size = reply_size(request),
            .until_ns = until_ns};
}

void Transport::forget_late(std::span<const std::uint8_t> pdu) noexcept {
  for (Late& late : late_) {
    if (late.until_ns == 0 || late.size != pdu.size() || late.function != pdu[0]) continue;
    late = {};
    return;
  }
}

bool Transport::send(const RequestBytes& request) noexcept {
  if (settings_.serial)
    return modbus_send_raw_request(context_.get(), request.data.data(),
                                   static_cast<int>(request.size)) > 0;
  // libmodbus numbers raw requests 0, all of them.
  ++transaction_;
  std::array<std::uint8_t, tcp_header_bytes - 1 + sizeof(request.data)> frame{};
  frame[0] = static_cast<std::uint8_t>(transaction_ >> 8U);
  frame[1] = static_cast<std::uint8_t>(transaction_ & 0xFFU);
  frame[5] = static_cast<std::uint8_t>(request.size);
  std::copy_n(request.data.begin(), request.size, frame.begin() + tcp_header_bytes - 1);
  const std::size_t size = tcp_header_bytes - 1 + request.size;
  return ::send(socket(), frame.data(), size, MSG_NOSIGNAL | MSG_DONTWAIT) ==
         static_cast<ssize_t>(size);
}

Answer Transport::ask(const Request& wanted, std::int64_t deadline_ns,
                      std::span<std::uint16_t> registers) noexcept {
  Answer answer;
  if (!connected_) {
    answer.error = ENOTCONN;
    return answer;
  }
  Request request = wanted;
  take_in_late_answers();
  if (could_be_mistaken(request)) {
    answer.outcome = Outcome::timeout;
    if (!request.writes()) return answer;
    answer.write_only = true;
    request.function = Function::write_multiple;
    request.read_count = 0;
  }
  ++counters_.asked;
  const std::int64_t patience_ns = deadline_ns - monotonic_now_ns();
  const RequestBytes bytes = bytes_of(request);
  // On a serial line libmodbus drops, before it looks at their check sum, frames of other devices.
  if (settings_.serial) modbus_set_slave(context_.get(), request.unit);
  answer.sent_ns = monotonic_now_ns();
  if (!send(bytes)) {
    answer.error = errno;
    disconnect();
    return answer;
  }
  if (echoes_ && !discard_echo(bytes.size + crc_bytes, deadline_ns))
    answer.outcome = Outcome::timeout;
  else
    receive(request, deadline_ns, registers, answer);
  answer.received_ns = monotonic_now_ns();

  const std::int64_t earliest_ns = answer.sent_ns + wire_ns(bytes.size + crc_bytes);
  const std::int64_t latest_ns = answer.received_ns - wire_ns(1 + reply_size(request) + crc_bytes);
  const bool on_a_wire = earliest_ns <= latest_ns;
  answer.time_ns = on_a_wire ? earliest_ns + (latest_ns - earliest_ns) / 2
                             : answer.sent_ns + (answer.received_ns - answer.sent_ns) / 2;

  const bool answered = answer.outcome == Outcome::ok || answer.outcome == Outcome::exception;
  if (settings_.serial && !answered)
    expect_late(request,
                answer.received_ns + latest_answer * std::max<std::int64_t>(0, patience_ns));
  if (answer.outcome == Outcome::timeout) ++counters_.timeouts;
  if (answer.outcome == Outcome::exception) ++counters_.exceptions;
  if (answer.outcome == Outcome::spoiled) {
    ++counters_.spoiled;
    clear_input();
  }
  if (answer.outcome == Outcome::disconnected) disconnect();
  return answer;
}

void Transport::receive(const Request& request, std::int64_t deadline_ns,
                        std::span<std::uint16_t> registers, Answer& answer) noexcept {
  std::array<std::uint8_t, MODBUS_MAX_ADU_LENGTH> frame{};
  const std::size_t header = settings_.serial ? 1 : tcp_header_bytes;
  const std::size_t trailer = settings_.serial ? crc_bytes : 0;
  for (;;) {
    const std::int64_t left_ns = deadline_ns - monotonic_now_ns();
    answer.outcome = Outcome::timeout;
    if (left_ns <= 0) return;
    set_response_timeout(context_.get(), left_ns);
    const int length = modbus_receive_confirmation(context_.get(), frame.data());
    if (length < 0) {
      answer.error = errno;
      if (errno == ETIMEDOUT) return;
      const bool nonsense =
          errno == EMBBADCRC || errno == EMBBADDATA || errno == EMBBADEXC || errno == EMBMDATA;
      answer.outcome = nonsense ? Outcome::spoiled : Outcome::disconnected;
      return;
    }
    const auto size = static_cast<std::size_t>(length);
    if (size <= header + trailer) continue;  // another device's
    const bool ours =
        settings_.serial ? frame[0] == request.unit : (frame[0] << 8U | frame[1]) == transaction_;
    const std::span<const std::uint8_t> pdu{frame.data() + header, size - header - trailer};
    const Reply reply = ours ? read_reply(pdu, request, registers) : Reply{};
    if (reply.kind == ReplyKind::other) {
      ++counters_.late_answers;
      forget_late(pdu);
      continue;
    }
    answer.exception = reply.exception;
    answer.outcome = reply.kind == ReplyKind::matches ? Outcome::ok : Outcome::exception;
    return;
  }
}

bool Transport::discard_echo(std::size_t bytes, std::int64_t deadline_ns) noexcept {
  std::array<std::uint8_t, 64> echo{};
  while (bytes > 0) {
    if (!wait_for_input(socket(), deadline_ns)) return false;
    const ssize_t count = read(socket(), echo.data(), std::min(bytes, echo.size()));
    if (count <= 0) return false;
    bytes -= static_cast<std::size_t>(count);
  }
  return true;
}

void Transport::look_for_echo(const Request& request) noexcept {
  echoes_ = false;
  if (!settings_.serial || !connected_) return;
  clear_input();
  RequestBytes sent = bytes_of(request);
  if (!send(sent)) return;
  const std::uint16_t crc = crc16(sent.bytes());
  sent.data[sent.size++] = static_cast<std::uint8_t>(crc & 0xFFU);
  sent.data[sent.size++] = static_cast<std::uint8_t>(crc >> 8U);

  const std::int64_t until_ns = monotonic_now_ns() + echo_wait_ns;
  std::size_t same = 0;
  bool differs = false;
  while (same < sent.size && !differs && wait_for_input(socket(), until_ns)) {
    std::uint8_t byte = 0;
    if (read(socket(), &byte, 1) != 1) break;
    differs = byte != sent.data[same];
    ++same;
  }
  echoes_ = same == sent.size && !differs;
  while (wait_for_input(socket(), monotonic_now_ns() + echo_quiet_ns)) {
    std::array<std::uint8_t, 64> rest{};
    if (read(socket(), rest.data(), rest.size()) <= 0) break;
  }
  late_.fill({});
}

std::string Transport::describe(const Answer& answer) const {
  const std::string where = settings_.address() + ": ";
  switch (answer.outcome) {
    case Outcome::ok: return where + "answered";
    case Outcome::timeout: return where + "no answer in time";
    case Outcome::exception: return where + exception_text(answer.exception);
    case Outcome::spoiled:
      return where + "a spoiled answer (" + modbus_strerror(answer.error) + ")";
    case Outcome::disconnected:
      return where + "connection lost (" + modbus_strerror(answer.error) + ")";
  }
  return where;
}

}  // namespace sinerig::modbus
