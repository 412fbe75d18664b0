// One connection, TCP or serial line, and one question at a time on it, answered by a deadline.
// Answers that come after theirs are recognised and dropped: taken for the next answer they would
// make every later sample one period old, which looks like a clean phase lag. TCP frames have a
// number. Serial frames have none: there answers are told apart by their length, where the device
// lets more be read than is wanted; elsewhere nothing is read, after a time-out, until the late
// answer has come or can no longer come. Set-points go out meanwhile.
//
// Not thread-safe. Nothing in it is for the loop.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "drivers/modbus/late_answers.h"
#include "drivers/modbus/request.h"

struct _modbus;  // NOLINT(bugprone-reserved-identifier): the name that libmodbus gives it

namespace sinerig::modbus {

// Who switches the transmitter of a half-duplex line: nobody or the adapter, the kernel's serial
// driver, or this program through RTS.
enum class Rs485 : std::uint8_t { adapter, kernel, rts_up, rts_down };

struct ConnectionSettings {
  std::string name;  // of its section: [modbus.NAME]
  bool serial = false;
  std::string host;
  int port = 502;
  std::string device;
  int baud = 115200;
  char parity = 'E';  // 'N', 'E' or 'O'
  int stop_bits = 1;
  Rs485 rs485 = Rs485::adapter;
  std::int64_t silence_ns = 0;  // before a request: it ends a frame on a serial line

  std::string address() const { return serial ? device : host + ":" + std::to_string(port); }
};

enum class Outcome : std::uint8_t {
  ok,
  timeout,
  exception,     // the device refused
  spoiled,       // wrong check sum, or no Modbus
  disconnected,  // connection closed, device file gone
};

struct Answer {
  Outcome outcome = Outcome::disconnected;
  std::uint8_t exception = 0;
  // Nothing was read, and where nothing was to be written nothing asked: a late answer may still be
  // under way.
  bool withheld = false;
  int error = 0;  // errno of libmodbus
  std::int64_t sent_ns = 0;
  std::int64_t received_ns = 0;
  std::int64_t time_ns = 0;  // middle of when the device can have acted
};

struct TransportCounters {
  std::uint64_t asked = 0;
  std::uint64_t timeouts = 0;
  std::uint64_t late_answers = 0;  // recognised and dropped
  std::uint64_t spoiled = 0;
  std::uint64_t exceptions = 0;
  std::uint64_t connections = 0;
};

class Transport {
 public:
  explicit Transport(ConnectionSettings settings);
  ~Transport();
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;

  // Looks the host up; throws std::runtime_error saying what to look at. A serial line is this
  // transport's alone for as long as it is connected.
  void connect();
  // Again, at the address that connect() has found.
  bool try_connect() noexcept;
  // What the device has not answered is dropped with the connection, see give_up().
  void disconnect() noexcept;
  // TCP: whatever still waits to be delivered is thrown away (RST). Ended in the ordinary way, a
  // connection delivers its set-points when the device reads again, seconds later.
  void give_up() noexcept;
  bool connected() const noexcept { return connected_; }

  // Asks and waits until `deadline_ns` (CLOCK_MONOTONIC) at most; `registers` takes what is read.
  // A lost connection is closed; one of TCP is given up, too, after three writes that got no
  // answer.
  Answer ask(const Request& request, std::int64_t deadline_ns,
             std::span<std::uint16_t> registers) noexcept;

  // Serial lines: waits, until `deadline_ns` at most, for the silence that a question needs; ask()
  // does it by itself.
  void keep_silence(std::int64_t deadline_ns) const noexcept;

  // How long an answer may take as a rule: one to a question with less time left is late no sooner.
  void set_usual_patience(std::int64_t patience_ns) noexcept { usual_patience_ns_ = patience_ns; }

  // Serial lines: finds out whether the adapter returns what is sent. `request` must only read.
  void look_for_echo(const Request& request) noexcept;
  bool echoes() const noexcept { return echoes_; }

  // Time that a reply and its request take on the wire at least; 0 on TCP.
  std::int64_t wire_ns(std::size_t bytes) const noexcept;

  std::string describe(const Answer& answer) const;
  const ConnectionSettings& settings() const noexcept { return settings_; }
  const TransportCounters& counters() const noexcept { return counters_; }

 private:
  struct Close {
    void operator()(_modbus* context) const noexcept;
  };

  bool take_port() noexcept;
  void leave_port() noexcept;
  void keep_others_out(bool out) const noexcept;
  bool runs_at_its_rate() const noexcept;
  bool switch_transmitter() noexcept;
  bool send(const RequestBytes& request) noexcept;
  void note_answer(std::uint16_t number) noexcept;
  void receive(const Request& request, std::int64_t deadline_ns, std::span<std::uint16_t> registers,
               Answer& answer) noexcept;
  Outcome discard_echo(const RequestBytes& request, std::int64_t deadline_ns) noexcept;
  void take_in_late_answers() noexcept;
  void keep_stray(std::span<const std::uint8_t> bytes) noexcept;
  void clear_input() noexcept;
  int pending() const noexcept;
  int socket() const noexcept;

  ConnectionSettings settings_;
  std::unique_ptr<_modbus, Close> context_;
  TransportCounters counters_;
  std::string found_host_;         // its address, as connect() has found it
  std::uint16_t transaction_ = 0;  // of the newest question, TCP
  std::uint16_t answered_ = 0;     // newest question that got an answer, TCP
  int writes_waiting_ = 0;         // for an answer, TCP
  std::int64_t usual_patience_ns_ = 0;
  bool connected_ = false;
  bool echoes_ = false;
  int port_ = -1;     // serial lines: holds the lock that no other program of this kind gets
  LateAnswers late_;  // serial lines
  // Serial lines: what came between two questions, in which a late answer may not be whole yet.
  std::array<std::uint8_t, 512> stray_{};
  std::size_t stray_size_ = 0;
  std::int64_t busy_until_ns_ = 0;  // the line, as far as it is known
};

}  // namespace sinerig::modbus
