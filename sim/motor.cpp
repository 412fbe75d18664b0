#include "sim/motor.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace sinerig::sim {
namespace {

constexpr double plant_period_s = 1e-3;
constexpr std::int64_t plant_period_ns = 1'000'000;

std::size_t output_of(const LinearSystem& system, const std::string& name) {
  const auto found = std::ranges::find(system.outputs, name);
  if (found == system.outputs.end())
    throw std::invalid_argument(
        "a servo needs a plant with the outputs position and velocity; kind " +
        std::string("= \"mechanical\" has them"));
  return static_cast<std::size_t>(found - system.outputs.begin());
}

}  // namespace

Motor::Motor(const LinearSystem& system, std::int64_t start_ns)
    : start_ns_{start_ns},
      last_ns_{start_ns},
      plant_{system, plant_period_s},
      position_{output_of(system, "position")},
      velocity_{output_of(system, "velocity")},
      outputs_(plant_.outputs(), 0.0) {}

// The plant does not go back in time; a frame stamped before the last sample counts from there.
PlantTime Motor::plant_time(std::int64_t time_ns) {
  last_ns_ = std::max(last_ns_, time_ns);
  const std::int64_t elapsed_ns = last_ns_ - start_ns_;
  const std::int64_t within_ns = elapsed_ns % plant_period_ns;
  return {.tick = static_cast<std::uint64_t>(elapsed_ns / plant_period_ns),
          .fraction = static_cast<double>(within_ns) / static_cast<double>(plant_period_ns)};
}

// Whether or not anybody looks between the set-points: what is due leaves the plant's queue here.
void Motor::apply(double torque, std::int64_t time_ns) {
  torque_ = torque;
  sample(time_ns);
  plant_.make_room();
  plant_.apply(torque, plant_time(time_ns));
}

void Motor::sample(std::int64_t time_ns) {
  plant_.sample(plant_time(time_ns), outputs_);
}

}  // namespace sinerig::sim
