#include "drivers/gpio/edge_queue.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <unistd.h>

#include <linux/gpio.h>
#include <sys/ioctl.h>

#include "drivers/gpio/chips.h"

namespace sinerig::gpio {
namespace {

std::uint64_t flags_of(Bias bias) {
  switch (bias) {
    case Bias::as_is: return 0;
    case Bias::disabled: return GPIO_V2_LINE_FLAG_BIAS_DISABLED;
    case Bias::pull_up: return GPIO_V2_LINE_FLAG_BIAS_PULL_UP;
    case Bias::pull_down: return GPIO_V2_LINE_FLAG_BIAS_PULL_DOWN;
  }
  return 0;
}

class EdgeQueue final : public EdgeLines {
 public:
  explicit EdgeQueue(const LineRequest& request) : place_{locate(request)} {
    gpio_v2_line_request wanted{};
    std::ranges::copy(place_.offsets, wanted.offsets);
    std::strncpy(wanted.consumer, consumer, sizeof wanted.consumer - 1);
    wanted.num_lines = static_cast<std::uint32_t>(place_.offsets.size());
    wanted.event_buffer_size = queue_length;
    wanted.config.flags = GPIO_V2_LINE_FLAG_INPUT | GPIO_V2_LINE_FLAG_EDGE_RISING |
                          GPIO_V2_LINE_FLAG_EDGE_FALLING | flags_of(request.bias);
    const int chip = ::open(place_.path.c_str(), O_RDWR | O_CLOEXEC);
    const bool held = chip >= 0 && ioctl(chip, GPIO_V2_GET_LINE_IOCTL, &wanted) == 0;
    const int error = errno;
    if (chip >= 0) ::close(chip);
    if (!held) refuse(request, place_, error);
    fd_ = wanted.fd;
    fcntl(fd_, F_SETFL, O_NONBLOCK);
  }
  ~EdgeQueue() override { ::close(fd_); }
  EdgeQueue(const EdgeQueue&) = delete;
  EdgeQueue& operator=(const EdgeQueue&) = delete;

  std::optional<std::uint32_t> get() noexcept override {
    gpio_v2_line_values values{};
    values.mask = (std::uint64_t{1} << place_.offsets.size()) - 1;
    const SystemCall never_waits;
    if (ioctl(fd_, GPIO_V2_LINE_GET_VALUES_IOCTL, &values) != 0) return std::nullopt;
    return static_cast<std::uint32_t>(values.bits) ^ place_.inverted;
  }

  std::optional<std::size_t> take(std::span<Edge> edges) noexcept override {
    std::size_t taken = 0;
    while (taken < edges.size()) {
      const SystemCall never_waits;
      const std::size_t most = std::min(events_.size(), edges.size() - taken);
      const ssize_t bytes = ::read(fd_, events_.data(), most * sizeof events_[0]);
      if (bytes < 0) {
        if (errno == EAGAIN || errno == EINTR) break;
        return std::nullopt;
      }
      const std::size_t read = static_cast<std::size_t>(bytes) / sizeof events_[0];
      if (read == 0) return std::nullopt;
      for (std::size_t n = 0; n < read; ++n) edges[taken++] = edge_of(events_[n]);
      if (read < most) break;
    }
    return taken;
  }

 private:
  Edge edge_of(const gpio_v2_line_event& event) const noexcept {
    const auto line = static_cast<std::uint8_t>(std::ranges::find(place_.offsets, event.offset) -
                                                place_.offsets.begin());
    const bool high = event.id == GPIO_V2_LINE_EVENT_RISING_EDGE;
    return {.time_ns = static_cast<std::int64_t>(event.timestamp_ns),
            .sequence = event.seqno,
            .line = line,
            .active = high != (((place_.inverted >> line) & 1U) != 0)};
  }

  Place place_;
  int fd_ = -1;
  std::array<gpio_v2_line_event, 64> events_{};
};

}  // namespace

std::unique_ptr<EdgeLines> open_edge_queue(const LineRequest& request) {
  return std::make_unique<EdgeQueue>(request);
}

}  // namespace sinerig::gpio
