// A quadrature encoder as a sensor of the loop, decoded from edges that the kernel has stamped.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "drivers/driver.h"
#include "drivers/gpio/lines.h"
#include "drivers/gpio/quadrature.h"
#include "sweep/clock.h"

namespace sinerig::gpio {

struct EncoderSettings {
  // What a sample is. `count`: the middle of the step that the encoder stands on, at the moment of
  // the read: wrong by up to half a count. `edge`: the border between two counts, at the moment it
  // was crossed: right to the time stamp, but stale in ticks without an edge.
  enum class Samples : std::uint8_t { count, edge };

  double scale = 1.0;   // unit of the channel per count, four counts per line of the disc
  double offset = 0.0;  // value where the encoder stands when the rig is opened
  Samples samples = Samples::count;
  std::int64_t lag_ns = 100'000;  // samples are this old, so that no edge is still on its way
  std::uint64_t max_errors = 10;  // more illegal and lost edges than this: never believed again
};

class Encoder final : public Sensor {
 public:
  // Line 0 is A, line 1 is B. `clock` must outlive the sensor; its time base is that of the edges.
  Encoder(std::unique_ptr<EdgeLines> lines, const EncoderSettings& settings, const Clock& clock);

  // Fault::bus: an edge was illegal or lost since the last read, too many were, or the lines are
  // gone. Fault::stale: no edge since the last read (Samples::edge).
  Sample read() noexcept SINERIG_NONBLOCKING override;

  // Counts what has come while nobody looked; what was wrong so far is forgiven. Where edges were
  // lost, the position goes on from a wrong place. Throws std::runtime_error: the lines are gone.
  void catch_up();

  std::int64_t count() const noexcept { return decoder_.count(); }
  std::uint64_t illegal() const noexcept { return decoder_.illegal(); }
  std::uint64_t lost() const noexcept { return lost_; }  // overflow of the kernel's queue
  // Edges that came after a sample which they should have been in, and by how much the worst did.
  std::uint64_t late() const noexcept { return late_; }
  std::int64_t latest_ns() const noexcept { return latest_ns_; }

  // Why it is no longer believed, for people; empty while it is. Not for the loop.
  std::string reason() const;

  // What it has seen so far, for people. Not for the loop.
  std::string seen() const;

  // Whether samples without a fault were wrong: by an edge that came later than the lag allows for.
  bool doubtful() const noexcept {
    return late_ > 0 && settings_.samples == EncoderSettings::Samples::count;
  }

 private:
  static constexpr std::size_t capacity = std::size_t{2} * EdgeLines::queue_length;

  bool gather() noexcept SINERIG_NONBLOCKING;
  void count_until(std::int64_t time_ns) noexcept SINERIG_NONBLOCKING;
  std::uint64_t all_errors() const noexcept { return decoder_.illegal() + lost_; }
  std::uint64_t errors() const noexcept { return all_errors() - forgiven_; }

  std::unique_ptr<EdgeLines> lines_;
  EncoderSettings settings_;
  const Clock& clock_;
  Quadrature decoder_;
  std::array<Edge, capacity> waiting_;  // by sequence: edges not yet older than the lag
  std::size_t waiting_count_ = 0;
  std::uint32_t next_sequence_ = 1;
  std::uint64_t lost_ = 0;
  std::uint64_t forgiven_ = 0;  // errors before the last catch_up()
  std::uint64_t late_ = 0;
  std::int64_t latest_ns_ = 0;
  bool gone_ = false;
  bool crossed_ = false;  // an edge was counted by this read
  std::int64_t last_time_ns_ = 0;
  Sample last_;
};

}  // namespace sinerig::gpio
