// libgpiod 1.6 (Debian 12). It knows the kernel's first GPIO interface only, whose queue holds 16
// edges, loses the newest and does not tell, so that edges go past it: see edge_queue.cpp.
#include <array>
#include <cerrno>

#include <gpiod.h>

#include "drivers/gpio/chips.h"
#include "drivers/gpio/edge_queue.h"
#include "drivers/gpio/libgpiod.h"

namespace sinerig::gpio {
namespace {

struct CloseChip {
  void operator()(gpiod_chip* chip) const { gpiod_chip_close(chip); }
};

// Lines of a chip; both are given back together.
class Held {
 public:
  Held(const LineRequest& request, int direction, int flags, const int* initial)
      : place_{locate(request)}, chip_{gpiod_chip_open(place_.path.c_str())} {
    if (!chip_) refuse(request, place_, errno);
    std::vector<unsigned> offsets = place_.offsets;
    if (gpiod_chip_get_lines(chip_.get(), offsets.data(), static_cast<unsigned>(offsets.size()),
                             &lines_) != 0)
      refuse(request, place_, errno);
    const gpiod_line_request_config config{consumer, direction, flags};
    if (gpiod_line_request_bulk(&lines_, &config, initial) != 0) refuse(request, place_, errno);
  }
  ~Held() { gpiod_line_release_bulk(&lines_); }
  Held(const Held&) = delete;
  Held& operator=(const Held&) = delete;

  gpiod_line_bulk* lines() { return &lines_; }
  unsigned count() const { return static_cast<unsigned>(place_.offsets.size()); }
  std::uint32_t inverted() const { return place_.inverted; }

 private:
  Place place_;
  std::unique_ptr<gpiod_chip, CloseChip> chip_;
  gpiod_line_bulk lines_ = GPIOD_LINE_BULK_INITIALIZER;
};

using Values = std::array<int, GPIOD_LINE_BULK_MAX_LINES>;

Values values_of(std::uint32_t levels) noexcept {
  Values values{};
  for (std::size_t n = 0; n < 32; ++n) values[n] = (levels >> n) & 1U ? 1 : 0;
  return values;
}

// What is active low is inverted here: the library's flag would stand for all lines of a request.
std::uint32_t inverted_of(const LineRequest& request) {
  std::uint32_t inverted = 0;
  for (std::size_t n = 0; n < request.lines.size(); ++n)
    if (request.lines[n].active_low) inverted |= 1U << n;
  return inverted;
}

int flags_of(Bias bias) {
  switch (bias) {
    case Bias::as_is: return 0;
    case Bias::disabled: return GPIOD_LINE_REQUEST_FLAG_BIAS_DISABLE;
    case Bias::pull_up: return GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_UP;
    case Bias::pull_down: return GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_DOWN;
  }
  return 0;
}

class Outputs final : public OutputLines {
 public:
  Outputs(const LineRequest& request, std::uint32_t initial)
      : held_{request, GPIOD_LINE_REQUEST_DIRECTION_OUTPUT, 0,
              values_of(initial ^ inverted_of(request)).data()} {}

  bool set(std::uint32_t levels) noexcept override {
    const Values values = values_of(levels ^ held_.inverted());
    const SystemCall never_waits;
    return gpiod_line_set_value_bulk(held_.lines(), values.data()) == 0;
  }

 private:
  Held held_;
};

class Inputs final : public InputLines {
 public:
  explicit Inputs(const LineRequest& request)
      : held_{request, GPIOD_LINE_REQUEST_DIRECTION_INPUT, flags_of(request.bias), nullptr} {}

  std::optional<std::uint32_t> get() noexcept override {
    Values values{};
    const SystemCall never_waits;
    if (gpiod_line_get_value_bulk(held_.lines(), values.data()) != 0) return std::nullopt;
    std::uint32_t levels = 0;
    for (unsigned n = 0; n < held_.count(); ++n)
      if (values[n] != 0) levels |= 1U << n;
    return levels ^ held_.inverted();
  }

 private:
  Held held_;
};

class Bank final : public LineBank {
 public:
  std::unique_ptr<OutputLines> outputs(const LineRequest& request, std::uint32_t initial) override {
    return std::make_unique<Outputs>(request, initial);
  }
  std::unique_ptr<InputLines> inputs(const LineRequest& request) override {
    return std::make_unique<Inputs>(request);
  }
  std::unique_ptr<EdgeLines> edges(const LineRequest& request) override {
    return open_edge_queue(request);
  }
};

}  // namespace

std::unique_ptr<LineBank> kernel_lines() {
  return std::make_unique<Bank>();
}

}  // namespace sinerig::gpio
