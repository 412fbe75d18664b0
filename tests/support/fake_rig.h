// An actuator, sensors and a clock that do as they are told and remember what they got.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "drivers/driver.h"
#include "support/outside_the_loop.h"
#include "sweep/clock.h"

namespace sinerig::test {

// Every tick in turn, except those that `skip` names a gap before.
class ScriptedClock final : public Clock {
 public:
  // `skip(index)`: how many ticks are lost before the tick that would be `index`.
  using Skip = std::function<std::uint64_t(std::uint64_t index)>;

  explicit ScriptedClock(double rate_hz, Skip skip = {})
      : Clock{TickGrid{rate_hz}}, skip_{std::move(skip)} {}

  Tick wait() noexcept override {
    if (skip_ && next_ > 0) next_ += skip_(next_);
    return {.index = next_++, .lateness = {}};
  }
  Instant now() const noexcept override {
    return {.tick = next_ == 0 ? 0 : next_ - 1, .offset_ns = 0};
  }
  std::int64_t time_ns(Instant instant) const noexcept override {
    return grid().time_ns(instant.tick) + instant.offset_ns;
  }
  std::uint64_t tick() const noexcept { return now().tick; }

 private:
  Skip skip_;
  std::uint64_t next_ = 0;
};

struct Write {
  std::uint64_t tick;
  double command;
};

class FakeActuator final : public Actuator {
 public:
  explicit FakeActuator(const Clock& clock, double neutral = 0.0)
      : clock_{clock}, neutral_{neutral} {}

  Sample write(double command) noexcept override {
    const OutsideTheLoop noting_down;
    writes.push_back({.tick = clock_.now().tick, .command = command});
    last = command;
    released = false;
    const Fault fault = fault_at ? fault_at(clock_.now().tick) : Fault::none;
    const double applied = apply ? apply(command) : command;
    return {.value = applied, .time_ns = clock_.time_ns(clock_.now()), .fault = fault};
  }
  void release() noexcept override {
    last = neutral_;
    released = true;
    ++releases;
    if (on_release) on_release();
  }

  std::function<Fault(std::uint64_t tick)> fault_at;
  std::function<double(double command)> apply;
  std::function<void()> on_release;

  std::vector<Write> writes;
  double last = 0.0;  // what it was given last
  bool released = false;
  int releases = 0;

 private:
  const Clock& clock_;
  double neutral_;
};

class FakeSensor final : public Sensor {
 public:
  using Value = std::function<double(std::uint64_t tick)>;

  FakeSensor(const Clock& clock, Value value_of_tick)
      : value{std::move(value_of_tick)}, clock_{clock} {}

  Sample read() noexcept override {
    const Instant now = clock_.now();
    const Fault fault = fault_at ? fault_at(now.tick) : Fault::none;
    if (fault == Fault::stale) {
      Sample again = last_;
      again.fault = fault;
      return again;
    }
    last_ = {.value = value(now.tick), .time_ns = clock_.time_ns(now), .fault = fault};
    return last_;
  }

  Value value;
  std::function<Fault(std::uint64_t tick)> fault_at;

 private:
  const Clock& clock_;
  Sample last_;
};

}  // namespace sinerig::test
