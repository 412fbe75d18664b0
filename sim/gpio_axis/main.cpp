// gpio_axis AXIS.toml : an actuator and a quadrature encoder on the lines of gpio-sim, until it is
// killed or --for SECONDS.
#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <exception>
#include <limits>
#include <memory>
#include <poll.h>
#include <sched.h>
#include <vector>

#include "sim/gpio_axis/axis.h"
#include "sim/gpio_axis/settings.h"
#include "sim/gpio_axis/sim_lines.h"

namespace {

using namespace sinerig::sim;

constexpr std::int64_t never_ns = std::numeric_limits<std::int64_t>::max();

// Without an edge the axis is looked at this far ahead.
constexpr std::int64_t horizon_ns = 2'000'000;

constexpr int burst_edges = 3000;

volatile std::sig_atomic_t stop_requested = 0;

void request_stop(int /*signal*/) {
  stop_requested = 1;
}

std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

class Device {
 public:
  explicit Device(const AxisSettings& settings)
      : settings_{settings},
        folder_{sim_chip_folder(settings.chip)},
        start_ns_{monotonic_ns()},
        axis_{settings.system, settings.measured, settings.per_count, start_ns_},
        line_{folder_, settings.line},
        a_{folder_, settings.encoder_a},
        b_{folder_, settings.encoder_b} {
    if (settings.output != "density")
      direction_ = std::make_unique<DrivenLine>(folder_, settings.direction_line);
    if (settings.enable_line)
      enable_ = std::make_unique<DrivenLine>(folder_, *settings.enable_line);
    if (settings.interlock_line) {
      interlock_ = std::make_unique<PulledLine>(folder_, *settings.interlock_line);
      interlock_->pull(true);
    }
    for (const DrivenLine* line : {&line_, direction_.get(), enable_.get()})
      if (line != nullptr) polled_.push_back({.fd = line->fd(), .events = POLLPRI, .revents = 0});
    show(axis_.count());
    watch(start_ns_);
  }

  ~Device() {
    if (opened_ns_ != 0 && off_ns_ != 0)
      std::printf("off %.6f s after the interlock opened\n",
                  static_cast<double>(off_ns_ - opened_ns_) * 1e-9);
  }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  void run(double seconds) {
    const std::int64_t end_ns = start_ns_ + std::llround(std::min(seconds, 1e9) * 1e9);
    std::int64_t now_ns = start_ns_;
    while (stop_requested == 0 && now_ns < end_ns) {
      const auto crossing = axis_.next(now_ns + horizon_ns);
      if (crossing && crossing->time_ns <= now_ns) {
        axis_.take(*crossing);
        show(axis_.count());
        continue;
      }
      cause_faults(now_ns);
      const std::int64_t due_ns =
          std::min({crossing ? crossing->time_ns : now_ns + horizon_ns, next_fault_ns(), end_ns});
      const bool driven = wait_until(due_ns);
      now_ns = monotonic_ns();
      // What the axis did before the input changed comes first.
      if (!driven) continue;
      while (const auto passed = axis_.next(now_ns)) {
        axis_.take(*passed);
        show(axis_.count());
      }
      watch(now_ns);
    }
  }

 private:
  // Four counts are one period of the two signals; A leads when the count rises.
  void show(std::int64_t count) {
    if (monotonic_ns() >= fault_ns(settings_.faults.stuck_at_s, false)) return;
    const auto quarter = static_cast<std::uint64_t>(count) % 4;
    const bool a = quarter == 1 || quarter == 2;
    const bool b = quarter >= 2;
    if (a != a_high_) a_.pull(a);
    if (b != b_high_) b_.pull(b);
    a_high_ = a;
    b_high_ = b;
  }

  // Takes in the levels that the program under test drives.
  void watch(std::int64_t now_ns) {
    const bool enabled = !enable_ || enable_->high();
    const bool line = line_.high();
    const bool direction = direction_ && direction_->high();
    double input = driven(settings_, line, direction);
    if (settings_.output == "step") {
      if (enabled && line && !line_was_high_) stepped_to_ += input;
      input = stepped_to_;
    } else if (!enabled) {
      input = 0.0;
    }
    line_was_high_ = line;
    if (opened_ns_ != 0 && off_ns_ == 0 && !enabled) off_ns_ = now_ns;
    if (input == input_) return;
    input_ = input;
    axis_.apply(input, now_ns);
  }

  bool wait_until(std::int64_t due_ns) {
    const std::int64_t left_ns = std::max<std::int64_t>(due_ns - monotonic_ns(), 0);
    const timespec timeout{.tv_sec = left_ns / 1'000'000'000, .tv_nsec = left_ns % 1'000'000'000};
    return ppoll(polled_.data(), polled_.size(), &timeout, nullptr) > 0;
  }

  std::int64_t fault_ns(double at_s, bool done) const {
    return done || at_s <= 0.0 ? never_ns : start_ns_ + std::llround(at_s * 1e9);
  }
  std::int64_t next_fault_ns() const {
    const AxisFaults& faults = settings_.faults;
    return std::min({fault_ns(faults.pulse_at_s, pulsed_), fault_ns(faults.burst_at_s, burst_),
                     fault_ns(faults.interlock_at_s, opened_)});
  }

  void cause_faults(std::int64_t now_ns) {
    const AxisFaults& faults = settings_.faults;
    if (now_ns >= fault_ns(faults.pulse_at_s, pulsed_)) {
      pulsed_ = true;
      pulse();
    }
    if (now_ns >= fault_ns(faults.burst_at_s, burst_)) {
      burst_ = true;
      for (int n = 0; n < burst_edges; ++n) a_.pull(a_high_ != (n % 2 == 0));
    }
    if (now_ns >= fault_ns(faults.interlock_at_s, opened_)) {
      opened_ = true;
      opened_ns_ = monotonic_ns();
      if (interlock_) interlock_->pull(false);
    }
  }

  // Above the priority of the kernel's interrupt threads, so that they see its end only.
  void pulse() {
    const sched_param urgent{.sched_priority = 99};
    const sched_param ordinary{.sched_priority = 0};
    if (sched_setscheduler(0, SCHED_FIFO, &urgent) != 0) std::perror("gpio_axis: SCHED_FIFO");
    a_.pull(!a_high_);
    a_.pull(a_high_);
    sched_setscheduler(0, SCHED_OTHER, &ordinary);
  }

  const AxisSettings& settings_;
  std::string folder_;
  std::int64_t start_ns_;
  Axis axis_;
  DrivenLine line_;
  PulledLine a_;
  PulledLine b_;
  std::unique_ptr<DrivenLine> direction_;
  std::unique_ptr<DrivenLine> enable_;
  std::unique_ptr<PulledLine> interlock_;
  std::vector<pollfd> polled_;
  bool a_high_ = false;
  bool b_high_ = false;
  bool line_was_high_ = false;
  double stepped_to_ = 0.0;
  double input_ = 0.0;
  std::int64_t opened_ns_ = 0;  // the interlock
  std::int64_t off_ns_ = 0;     // the first time that the drive was disabled after that
  bool pulsed_ = false;
  bool burst_ = false;
  bool opened_ = false;
};

}  // namespace

int main(int count, char** arguments) {
  const bool bounded = count == 4 && std::strcmp(arguments[2], "--for") == 0;
  if (count != 2 && !bounded) {
    std::fprintf(stderr, "usage: gpio_axis AXIS.toml [--for SECONDS]\n");
    return 2;
  }
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
  try {
    const auto file = sinerig::config::RigFile::load(arguments[1]);
    const AxisSettings settings = read_axis(*file);
    Device device{settings};
    std::printf("on %s\n", settings.chip.c_str());
    std::fflush(stdout);
    device.run(bounded ? std::strtod(arguments[3], nullptr) : 1e9);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "gpio_axis: %s\n", error.what());
    return 1;
  }
}
