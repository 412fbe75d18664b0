#include "drivers/can/bus.h"

#include <linux/can/error.h>

namespace sinerig::can {

const char* to_string(BusState state) noexcept {
  switch (state) {
    case BusState::up: return "up";
    case BusState::bus_off: return "bus-off";
    case BusState::link_down: return "link down";
    case BusState::gone: return "interface gone";
  }
  return "unknown";
}

std::string describe(const std::string& interface, BusState state) {
  std::string text = interface + ": " + to_string(state);
  if (state == BusState::bus_off)
    text += "; a controller with restart-ms 0, the default, stays off: `ip link set " + interface +
            " down`, then `… up type can restart-ms 100`";
  return text;
}

std::size_t Bus::listen(const Pattern& pattern, const Checksum& checksum) {
  Slot slot;
  slot.pattern = pattern;
  slot.checksum = checksum;
  slots_.push_back(slot);
  return slots_.size() - 1;
}

void Bus::start() {
  std::vector<IdFilter> filters;
  for (const Slot& slot : slots_) {
    const std::uint32_t id_bits = slot.pattern.extended ? max_extended_id : max_standard_id;
    filters.push_back({slot.pattern.id, slot.pattern.id_mask & id_bits, slot.pattern.extended});
  }
  socket_.set_filters(filters);
}

bool Bus::poll() noexcept {
  if (state_ == BusState::gone) try_to_rebind();
  Received received;
  for (int n = 0; n < max_frames_per_poll; ++n) {
    switch (socket_.receive(received)) {
      case ReceiveResult::frame: dispatch(received); break;
      case ReceiveResult::error_frame: note_error(received.error_class); break;
      case ReceiveResult::link_down: state_ = BusState::link_down; break;
      case ReceiveResult::gone: state_ = BusState::gone; break;
      case ReceiveResult::nothing: counters_.overflows = socket_.overflows(); return true;
    }
  }
  return false;
}

void Bus::drain() noexcept {
  constexpr int longest_queue = 64;  // of net.core.rmem_max raised to tens of megabytes
  for (int n = 0; n < longest_queue && !poll(); ++n) {
  }
}

// A frame of somebody else (a socket does not see its own) proves that the bus works again.
void Bus::dispatch(const Received& received) noexcept {
  state_ = BusState::up;
  for (Slot& slot : slots_) {
    if (!slot.pattern.matches(received.frame)) continue;
    if (!is_sealed(received.frame, slot.checksum)) {
      ++slot.spoiled;
      ++counters_.bad_checksums;
      continue;
    }
    slot.frame = received.frame;
    slot.time_ns = received.time_ns;
    ++slot.count;
    ++counters_.received;
  }
}

void Bus::note_error(std::uint32_t error_class) noexcept {
  ++counters_.error_frames;
  if ((error_class & CAN_ERR_BUSOFF) != 0) {
    if (state_ != BusState::bus_off) ++counters_.bus_offs;
    state_ = BusState::bus_off;
  } else if ((error_class & CAN_ERR_RESTARTED) != 0) {
    state_ = BusState::up;
  }
}

void Bus::try_to_rebind() noexcept {
  const std::int64_t now_ns = monotonic_ns();
  if (now_ns < next_rebind_ns_) return;
  next_rebind_ns_ = now_ns + rebind_period_ns;
  if (socket_.rebind()) state_ = BusState::link_down;
}

SendResult Bus::send(const Frame& frame) noexcept {
  if (state_ == BusState::bus_off || state_ == BusState::gone) {
    ++counters_.dropped_dead;
    return state_ == BusState::gone ? SendResult::gone : SendResult::failed;
  }
  const SendResult result = socket_.send(frame);
  switch (result) {
    case SendResult::sent:
      ++counters_.sent;
      state_ = BusState::up;
      break;
    case SendResult::queue_full: ++counters_.dropped_full; break;
    case SendResult::link_down:
      ++counters_.dropped_dead;
      state_ = BusState::link_down;
      break;
    case SendResult::gone:
      ++counters_.dropped_dead;
      state_ = BusState::gone;
      break;
    case SendResult::failed: ++counters_.dropped_dead; break;
  }
  return result;
}

void Bus::reserve(Room room) noexcept {
  constexpr std::size_t for_lists = 128;
  socket_.set_send_room(room == Room::lists ? for_lists : 2 * frames_per_tick_);
}

void Bus::wait_and_poll(std::int64_t timeout_ns) noexcept {
  socket_.wait(timeout_ns);
  poll();
}

}  // namespace sinerig::can
