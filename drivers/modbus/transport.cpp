#include "drivers/modbus/transport.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <poll.h>
#include <stdexcept>
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
constexpr std::int64_t echo_wait_ns = 300'000'000;
constexpr std::int64_t echo_quiet_ns = 50'000'000;

// An answer that is this many time-outs late is taken for lost.
constexpr std::int64_t latest_answer = 5;

// Each waits in the connection to a device that has stopped reading, and is carried out when it
// goes on. A single lost packet is made good for by the kernel once the next question follows it.
constexpr int most_writes_waiting = 3;

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

// As it goes out on a serial line.
RequestBytes with_check_sum(RequestBytes request) noexcept {
  const std::uint16_t crc = crc16(request.bytes());
  request.data[request.size++] = static_cast<std::uint8_t>(crc & 0xFFU);
  request.data[request.size++] = static_cast<std::uint8_t>(crc >> 8U);
  return request;
}

}  // namespace

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
    take_in_late_answers();
  } else {
    modbus_flush(context_.get());
  }
}

void Transport::take_in_late_answers() noexcept {
  if (!settings_.serial) return;
  std::array<std::uint8_t, 256> bytes{};
  while (pending() > 0) {
    const ssize_t count = read(socket(), bytes.data(), bytes.size());
    if (count <= 0) break;
    busy_until_ns_ = monotonic_now_ns();
    keep_stray(std::span{bytes}.first(static_cast<std::size_t>(count)));
  }
  while (const std::size_t end = late_.take_from(std::span{stray_}.first(stray_size_))) {
    ++counters_.late_answers;
    std::copy(stray_.begin() + static_cast<std::ptrdiff_t>(end),
              stray_.begin() + static_cast<std::ptrdiff_t>(stray_size_), stray_.begin());
    stray_size_ -= end;
  }
}

// The newest of them, where there are more than any answer has.
void Transport::keep_stray(std::span<const std::uint8_t> bytes) noexcept {
  if (stray_size_ + bytes.size() > stray_.size()) stray_size_ = 0;
  std::ranges::copy(bytes, stray_.begin() + static_cast<std::ptrdiff_t>(stray_size_));
  stray_size_ += bytes.size();
}

// Without it those on the line take two frames for one, and drop both.
void Transport::keep_silence(std::int64_t deadline_ns) const noexcept {
  if (!settings_.serial) return;
  const std::int64_t until_ns = std::min(busy_until_ns_ + settings_.silence_ns, deadline_ns);
  const timespec until{.tv_sec = until_ns / ns_per_s, .tv_nsec = until_ns % ns_per_s};
  while (monotonic_now_ns() < until_ns)
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
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
  keep_silence(deadline_ns);
  take_in_late_answers();
  if (settings_.serial && late_.could_be(request, monotonic_now_ns())) {
    answer.outcome = Outcome::timeout;
    answer.withheld = true;
    if (!request.writes()) return answer;
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
  answer.outcome = echoes_ ? discard_echo(bytes, deadline_ns) : Outcome::ok;
  if (answer.outcome == Outcome::ok) receive(request, deadline_ns, registers, answer);
  answer.received_ns = monotonic_now_ns();
  busy_until_ns_ = answer.received_ns;

  const std::int64_t earliest_ns = answer.sent_ns + wire_ns(bytes.size + crc_bytes);
  const std::int64_t latest_ns = answer.received_ns - wire_ns(1 + reply_size(request) + crc_bytes);
  const bool on_a_wire = earliest_ns <= latest_ns;
  answer.time_ns = on_a_wire ? earliest_ns + (latest_ns - earliest_ns) / 2
                             : answer.sent_ns + (answer.received_ns - answer.sent_ns) / 2;

  const bool answered = answer.outcome == Outcome::ok || answer.outcome == Outcome::exception;
  if (settings_.serial && !answered)
    late_.expect(request,
                 answer.received_ns + latest_answer * std::max(usual_patience_ns_, patience_ns));
  if (answer.outcome == Outcome::timeout) ++counters_.timeouts;
  if (answer.outcome == Outcome::exception) ++counters_.exceptions;
  if (answer.outcome == Outcome::spoiled) {
    ++counters_.spoiled;
    clear_input();
  }
  if (answer.outcome == Outcome::disconnected) disconnect();
  const bool write_waits =
      !settings_.serial && request.writes() && answer.outcome == Outcome::timeout;
  if (write_waits && ++writes_waiting_ >= most_writes_waiting) give_up();
  return answer;
}

// An answer, whenever it comes, shows that everything before its question has been read.
void Transport::note_answer(std::uint16_t number) noexcept {
  const auto since = static_cast<std::uint16_t>(transaction_ - number);
  const auto waiting = static_cast<std::uint16_t>(transaction_ - answered_);
  if (since >= waiting) return;
  answered_ = number;
  // Those between it and the newest, which is being waited for.
  writes_waiting_ = std::min(writes_waiting_, std::max(0, since - 1));
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
      if (nonsense) note_answer(transaction_);
      return;
    }
    const auto size = static_cast<std::size_t>(length);
    if (size <= header + trailer) continue;  // another device's
    const auto number = static_cast<std::uint16_t>(frame[0] << 8U | frame[1]);
    if (!settings_.serial) note_answer(number);
    const bool ours = settings_.serial ? frame[0] == request.unit : number == transaction_;
    const std::span<const std::uint8_t> pdu{frame.data() + header, size - header - trailer};
    const Reply reply = ours ? read_reply(pdu, request, registers) : Reply{};
    if (reply.kind == ReplyKind::other) {
      ++counters_.late_answers;
      late_.forget(pdu);
      continue;
    }
    answer.exception = reply.exception;
    answer.outcome = reply.kind == ReplyKind::matches ? Outcome::ok : Outcome::exception;
    return;
  }
}

// What comes in the place of an echo is a late answer, or noise before it.
Outcome Transport::discard_echo(const RequestBytes& request, std::int64_t deadline_ns) noexcept {
  const RequestBytes sent = with_check_sum(request);
  std::array<std::uint8_t, sizeof(sent.data)> echo{};
  std::size_t size = 0;
  while (size < sent.size) {
    if (!wait_for_input(socket(), deadline_ns)) return Outcome::timeout;
    const ssize_t count = read(socket(), echo.data() + size, sent.size - size);
    if (count <= 0) return Outcome::timeout;
    size += static_cast<std::size_t>(count);
  }
  const auto came = std::span<const std::uint8_t>{echo}.first(size);
  if (std::ranges::equal(came, sent.bytes())) return Outcome::ok;
  keep_stray(came);
  return Outcome::spoiled;
}

void Transport::look_for_echo(const Request& request) noexcept {
  echoes_ = false;
  if (!settings_.serial || !connected_) return;
  clear_input();
  if (!send(bytes_of(request))) return;
  const RequestBytes sent = with_check_sum(bytes_of(request));

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
  late_.clear();
  stray_size_ = 0;
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
