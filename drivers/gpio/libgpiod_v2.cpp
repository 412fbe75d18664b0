// libgpiod 2.x (Debian 13).
#include <algorithm>
#include <array>
#include <cerrno>
#include <fcntl.h>
#include <stdexcept>

#include <gpiod.h>

#include "drivers/gpio/chips.h"
#include "drivers/gpio/libgpiod.h"

namespace sinerig::gpio {
namespace {

template <auto free_it>
struct Free {
  template <class Object>
  void operator()(Object* object) const {
    free_it(object);
  }
};
template <class Object, auto free_it>
using Owned = std::unique_ptr<Object, Free<free_it>>;

template <class Object>
Object* allocated(Object* object) {
  if (object == nullptr) throw std::bad_alloc{};
  return object;
}

constexpr std::size_t most_lines = 32;

// What is active low is inverted here and not by the kernel, as under libgpiod 1.6.
class Held {
 public:
  struct Wish {
    gpiod_line_direction direction;
    bool edges = false;
    std::uint32_t initial = 0;
  };

  Held(const LineRequest& request, const Wish& wish) : place_{locate(request)} {
    Owned<gpiod_chip, gpiod_chip_close> chip{gpiod_chip_open(place_.path.c_str())};
    if (!chip) refuse(request, place_, errno);
    Owned<gpiod_request_config, gpiod_request_config_free> config{
        allocated(gpiod_request_config_new())};
    gpiod_request_config_set_consumer(config.get(), consumer);
    if (wish.edges)
      gpiod_request_config_set_event_buffer_size(config.get(), EdgeLines::queue_length);
    Owned<gpiod_line_config, gpiod_line_config_free> lines{allocated(gpiod_line_config_new())};
    for (std::size_t n = 0; n < place_.offsets.size(); ++n) {
      Owned<gpiod_line_settings, gpiod_line_settings_free> settings{
          allocated(gpiod_line_settings_new())};
      const bool high = (((wish.initial ^ place_.inverted) >> n) & 1U) != 0;
      const bool set = gpiod_line_settings_set_direction(settings.get(), wish.direction) == 0 &&
                       gpiod_line_settings_set_output_value(settings.get(), value_of(high)) == 0 &&
                       gpiod_line_settings_set_bias(settings.get(), bias_of(request.bias)) == 0 &&
                       (!wish.edges || gpiod_line_settings_set_edge_detection(
                                           settings.get(), GPIOD_LINE_EDGE_BOTH) == 0) &&
                       gpiod_line_config_add_line_settings(lines.get(), &place_.offsets[n], 1,
                                                           settings.get()) == 0;
      if (!set) refuse(request, place_, errno);
    }
    request_.reset(gpiod_chip_request_lines(chip.get(), config.get(), lines.get()));
    if (!request_) refuse(request, place_, errno);
  }

  gpiod_line_request* request() { return request_.get(); }
  const Place& place() const { return place_; }

  std::optional<std::uint32_t> get() noexcept {
    std::array<gpiod_line_value, most_lines> values{};
    const SystemCall never_waits;
    if (gpiod_line_request_get_values(request_.get(), values.data()) != 0) return std::nullopt;
    std::uint32_t levels = 0;
    for (std::size_t n = 0; n < place_.offsets.size(); ++n)
      if (values[n] == GPIOD_LINE_VALUE_ACTIVE) levels |= 1U << n;
    return levels ^ place_.inverted;
  }

  bool set(std::uint32_t levels) noexcept {
    std::array<gpiod_line_value, most_lines> values{};
    for (std::size_t n = 0; n < most_lines; ++n)
      values[n] = value_of((((levels ^ place_.inverted) >> n) & 1U) != 0);
    const SystemCall never_waits;
    return gpiod_line_request_set_values(request_.get(), values.data()) == 0;
  }

 private:
  static gpiod_line_value value_of(bool high) noexcept {
    return high ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE;
  }
  static gpiod_line_bias bias_of(Bias bias) {
    switch (bias) {
      case Bias::as_is: return GPIOD_LINE_BIAS_AS_IS;
      case Bias::disabled: return GPIOD_LINE_BIAS_DISABLED;
      case Bias::pull_up: return GPIOD_LINE_BIAS_PULL_UP;
      case Bias::pull_down: return GPIOD_LINE_BIAS_PULL_DOWN;
    }
    return GPIOD_LINE_BIAS_AS_IS;
  }

  Place place_;
  Owned<gpiod_line_request, gpiod_line_request_release> request_;
};

class Outputs final : public OutputLines {
 public:
  Outputs(const LineRequest& request, std::uint32_t initial)
      : held_{request, {.direction = GPIOD_LINE_DIRECTION_OUTPUT, .initial = initial}} {}
  bool set(std::uint32_t levels) noexcept override { return held_.set(levels); }

 private:
  Held held_;
};

class Inputs final : public InputLines {
 public:
  explicit Inputs(const LineRequest& request)
      : held_{request, {.direction = GPIOD_LINE_DIRECTION_INPUT}} {}
  std::optional<std::uint32_t> get() noexcept override { return held_.get(); }

 private:
  Held held_;
};

class Edges final : public EdgeLines {
 public:
  explicit Edges(const LineRequest& request)
      : held_{request, {.direction = GPIOD_LINE_DIRECTION_INPUT, .edges = true}},
        buffer_{allocated(gpiod_edge_event_buffer_new(buffer_length))} {
    fcntl(gpiod_line_request_get_fd(held_.request()), F_SETFL, O_NONBLOCK);
  }

  std::optional<std::uint32_t> get() noexcept override { return held_.get(); }

  std::optional<std::size_t> take(std::span<Edge> edges) noexcept override {
    std::size_t taken = 0;
    while (taken < edges.size()) {
      const std::size_t most = std::min(buffer_length, edges.size() - taken);
      const SystemCall never_waits;
      const int read = gpiod_line_request_read_edge_events(held_.request(), buffer_.get(), most);
      if (read < 0) {
        if (errno == EAGAIN || errno == EINTR) break;
        return std::nullopt;
      }
      for (int n = 0; n < read; ++n)
        edges[taken++] =
            edge_of(gpiod_edge_event_buffer_get_event(buffer_.get(), static_cast<unsigned>(n)));
      if (static_cast<std::size_t>(read) < most) break;
    }
    return taken;
  }

 private:
  static constexpr std::size_t buffer_length = 64;

  Edge edge_of(gpiod_edge_event* event) const noexcept {
    const Place& place = held_.place();
    const auto line = static_cast<std::uint8_t>(
        std::ranges::find(place.offsets, gpiod_edge_event_get_line_offset(event)) -
        place.offsets.begin());
    const bool high = gpiod_edge_event_get_event_type(event) == GPIOD_EDGE_EVENT_RISING_EDGE;
    return {.time_ns = static_cast<std::int64_t>(gpiod_edge_event_get_timestamp_ns(event)),
            .sequence = static_cast<std::uint32_t>(gpiod_edge_event_get_global_seqno(event)),
            .line = line,
            .active = high != (((place.inverted >> line) & 1U) != 0)};
  }

  Held held_;
  Owned<gpiod_edge_event_buffer, gpiod_edge_event_buffer_free> buffer_;
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
    return std::make_unique<Edges>(request);
  }
};

}  // namespace

std::unique_ptr<LineBank> kernel_lines() {
  return std::make_unique<Bank>();
}

}  // namespace sinerig::gpio
