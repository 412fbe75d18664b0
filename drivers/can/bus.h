// One CAN interface shared by the actuator, the sensors and the health watches of a rig: drains the
// socket, keeps the newest frame of everything listened for, knows whether the bus is alive.
//
// listen() and start() come before the loop and may throw; the rest belongs to the loop's thread.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/can/frame_pattern.h"
#include "drivers/can/socket.h"
#include "sweep/nonblocking.h"
#include "sweep/waiting.h"

namespace sinerig::can {

enum class BusState : std::uint8_t { up, bus_off, link_down, gone };

const char* to_string(BusState state) noexcept;

// For people: of which interface, and what to do about it.
std::string describe(const std::string& interface, BusState state);

struct BusCounters {
  std::uint64_t sent = 0;
  std::uint64_t dropped_full = 0;  // the transmit queue was full
  std::uint64_t dropped_dead = 0;  // bus-off, link down or gone: not even tried
  std::uint64_t received = 0;      // frames that something listens for
  std::uint64_t bad_checksums = 0;
  std::uint64_t error_frames = 0;
  std::uint64_t bus_offs = 0;
  std::uint64_t overflows = 0;  // frames that the kernel dropped because nobody read them in time
};

// The newest frame of one kind.
struct Slot {
  Pattern pattern;
  Checksum checksum;
  Frame frame;
  std::int64_t time_ns = 0;   // when it arrived, CLOCK_MONOTONIC
  std::uint64_t count = 0;    // frames so far: 0 = none yet
  std::uint64_t spoiled = 0;  // frames with a wrong checksum
};

class Bus {
 public:
  // `waiting`: for the lists that are run over it.
  Bus(const std::string& interface, bool fd_frames, const Waiting& waiting = {})
      : socket_(interface, fd_frames), waiting_(waiting) {}

  // The index of the slot that will hold the newest frame of this kind.
  std::size_t listen(const Pattern& pattern, const Checksum& checksum = {});

  // Tells the kernel which frames are wanted. Again after later listen()s.
  void start();

  // Takes in everything that has arrived, at most `max_frames_per_poll` frames; false where more
  // may wait.
  bool poll() noexcept SINERIG_NONBLOCKING;

  // All that has arrived while nobody looked. The kernel's queue keeps the oldest: what was sent
  // after it was full is not there. Not for the loop.
  void drain() noexcept;

  // Sends at once or never. On a dead bus nothing is tried: frames left in its queue would all go
  // out, late, when it comes back.
  SendResult send(const Frame& frame) noexcept SINERIG_NONBLOCKING;

  // How many frames may wait for the wire: in the loop a few, because a bus that nobody
  // acknowledges keeps them and sends them, old as they are, when the cable is back; for lists as
  // many as come, so that neutral and disarm line up behind those. Not for the loop.
  enum class Room : std::uint8_t { set_points, lists };
  void reserve(Room room) noexcept;

  // Frames that somebody sends at every tick. Before the loop.
  void plan_to_send(std::size_t frames_per_tick) noexcept { frames_per_tick_ += frames_per_tick; }

  // poll() after waiting for something to arrive. Not for the loop.
  void wait_and_poll(std::int64_t timeout_ns) noexcept;

  const Slot& slot(std::size_t index) const noexcept { return slots_[index]; }
  BusState state() const noexcept { return state_; }
  const BusCounters& counters() const noexcept { return counters_; }
  const std::string& interface() const noexcept { return socket_.interface(); }
  const Waiting& waiting() const noexcept { return waiting_; }

 private:
  static constexpr int max_frames_per_poll = 512;
  static constexpr std::int64_t rebind_period_ns = 100'000'000;

  void dispatch(const Received& received) noexcept;
  void note_error(std::uint32_t error_class) noexcept;
  void try_to_rebind() noexcept;

  Socket socket_;
  Waiting waiting_;
  std::vector<Slot> slots_;
  BusState state_ = BusState::up;
  BusCounters counters_;
  std::int64_t next_rebind_ns_ = 0;
  std::size_t frames_per_tick_ = 0;
};

}  // namespace sinerig::can
