// A bank of GPIO lines in the same process: outputs are seen, inputs are set, edges are queued as
// the kernel would, on whatever clock the test has.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "drivers/gpio/lines.h"

namespace sinerig::test {

// What the lines do, kept by the test: the objects that the driver is given come and go.
struct FakeLines {
  std::uint32_t driven = 0;            // levels of the outputs
  std::vector<std::uint32_t> history;  // every set(), the initial levels first
  bool outputs_held = false;
  bool refuse = false;       // the kernel fails every call
  std::uint32_t levels = 0;  // of the inputs
  std::vector<gpio::Edge> queue;
  std::uint32_t sequence = 0;
  std::vector<gpio::LineRequest> requests;
  std::function<void(std::uint32_t)> on_set = [](std::uint32_t) {
  };
  std::function<void()> before_read = [] {
  };

  // An edge of one input line at a time; `seen` false: the kernel's queue had no room for it.
  void edge(std::uint8_t line, std::int64_t time_ns, bool seen = true) {
    levels ^= 1U << line;
    ++sequence;
    if (seen) queue.push_back({time_ns, sequence, line, (levels & (1U << line)) != 0});
  }

  // The quarter of a period that a count stands for; A leads when it rises.
  void show_count(std::int64_t count, std::int64_t time_ns) {
    const auto quarter = static_cast<std::uint64_t>(count) % 4;
    const std::uint32_t wanted =
        (quarter == 1 || quarter == 2 ? 1U : 0U) | (quarter >= 2 ? 2U : 0U);
    for (const std::uint8_t line : {std::uint8_t{0}, std::uint8_t{1}})
      if (((levels ^ wanted) & (1U << line)) != 0) edge(line, time_ns);
  }
};

class FakeBank final : public gpio::LineBank {
 public:
  explicit FakeBank(FakeLines& lines) : lines_{lines} {}

  std::unique_ptr<gpio::OutputLines> outputs(const gpio::LineRequest& request,
                                             std::uint32_t initial) override {
    lines_.requests.push_back(request);
    return std::make_unique<Outputs>(lines_, initial);
  }
  std::unique_ptr<gpio::InputLines> inputs(const gpio::LineRequest& request) override {
    lines_.requests.push_back(request);
    return std::make_unique<Edges>(lines_);
  }
  std::unique_ptr<gpio::EdgeLines> edges(const gpio::LineRequest& request) override {
    lines_.requests.push_back(request);
    return std::make_unique<Edges>(lines_);
  }

 private:
  class Outputs final : public gpio::OutputLines {
   public:
    Outputs(FakeLines& lines, std::uint32_t initial) : lines_{lines} {
      lines_.outputs_held = true;
      set(initial);
    }
    ~Outputs() override { lines_.outputs_held = false; }
    bool set(std::uint32_t levels) noexcept override {
      if (lines_.refuse) return false;
      lines_.driven = levels;
      lines_.history.push_back(levels);
      lines_.on_set(levels);
      return true;
    }

   private:
    FakeLines& lines_;
  };

  class Edges final : public gpio::EdgeLines {
   public:
    explicit Edges(FakeLines& lines) : lines_{lines} {}
    std::optional<std::uint32_t> get() noexcept override {
      if (lines_.refuse) return std::nullopt;
      return lines_.levels;
    }
    std::optional<std::size_t> take(std::span<gpio::Edge> edges) noexcept override {
      if (lines_.refuse) return std::nullopt;
      lines_.before_read();
      const std::size_t taken = std::min(edges.size(), lines_.queue.size());
      const auto end = lines_.queue.begin() + static_cast<std::ptrdiff_t>(taken);
      std::copy(lines_.queue.begin(), end, edges.begin());
      lines_.queue.erase(lines_.queue.begin(), end);
      return taken;
    }

   private:
    FakeLines& lines_;
  };

  FakeLines& lines_;
};

}  // namespace sinerig::test
