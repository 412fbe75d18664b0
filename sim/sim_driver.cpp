#include "sim/sim_driver.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "sim/drive_faults.h"

namespace sinerig::sim {

namespace {

using config::above_zero;
using config::any_number;
using config::fraction_of_one;
using config::Section;
using config::zero_or_more;

MechanicalAxis read_axis(const Section& plant) {
  MechanicalAxis axis;
  axis.inertia = plant.number("inertia", above_zero);
  axis.damping = plant.number("damping", zero_or_more, axis.damping);
  axis.stiffness = plant.number("stiffness", zero_or_more, axis.stiffness);
  axis.gain = plant.number("gain", any_number, axis.gain);
  axis.lag_hz = plant.number("lag_hz", zero_or_more, axis.lag_hz);
  for (const Section& mode : plant.tables("modes")) {
    axis.modes.push_back({.frequency_hz = mode.number("frequency_hz", above_zero),
                          .damping = mode.number("damping", {.min = 0.0, .max = 10.0}),
                          .residue = mode.number("residue", any_number)});
  }
  return axis;
}

Eigen::MatrixXd read_matrix(const Section& plant, std::string_view key) {
  const auto rows = plant.rows(key, any_number);
  const std::size_t columns = rows.empty() ? 0 : rows.front().size();
  Eigen::MatrixXd matrix(static_cast<Eigen::Index>(rows.size()),
                         static_cast<Eigen::Index>(columns));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].size() != columns) plant.refuse(key, "every row must have the same length");
    for (std::size_t j = 0; j < columns; ++j) {
      matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = rows[i][j];
    }
  }
  return matrix;
}

Eigen::VectorXd read_vector(const Section& plant, std::string_view key) {
  const std::vector<double> numbers = plant.numbers(key, any_number);
  return Eigen::Map<const Eigen::VectorXd>(numbers.data(),
                                           static_cast<Eigen::Index>(numbers.size()));
}

// The builders' refusals, put at the key they are about.
template <typename Build>
LinearSystem built_at(const Section& plant, std::string_view key, Build build) {
  try {
    return build();
  } catch (const std::invalid_argument& refused) {
    plant.refuse(key, refused.what());
  }
}

LinearSystem read_system(const Section& plant) {
  const std::string kind =
      plant.choice("kind", {"mechanical", "transfer_function", "zeros_poles", "state_space"});
  if (kind == "transfer_function") {
    const auto num = plant.numbers("num", any_number);
    const auto den = plant.numbers("den", any_number);
    return built_at(plant, "den", [&] { return from_transfer_function(num, den); });
  }
  if (kind == "zeros_poles") {
    const double gain = plant.number("gain", any_number);
    const auto zeros = plant.roots("zeros");
    const auto poles = plant.roots("poles");
    return built_at(plant, "zeros", [&] { return from_zeros_poles(zeros, poles, gain); });
  }
  if (kind == "state_space") {
    const auto names = plant.texts("outputs");
    const Eigen::MatrixXd a = read_matrix(plant, "a");
    const Eigen::MatrixXd c = read_matrix(plant, "c");
    const Eigen::VectorXd b = read_vector(plant, "b");
    const Eigen::VectorXd d =
        plant.has("d") ? read_vector(plant, "d") : Eigen::VectorXd::Zero(c.rows());
    return built_at(plant, "a", [&] { return from_state_space(a, b, c, d, names); });
  }
  return from_mechanical_axis(read_axis(plant));
}

Friction read_friction(const Section& plant, const LinearSystem& system) {
  Friction friction;
  friction.coulomb = plant.number("coulomb_friction", zero_or_more, friction.coulomb);
  friction.breakaway = plant.number("breakaway_friction", zero_or_more, friction.breakaway);
  friction.stribeck_velocity =
      plant.number("stribeck_velocity", above_zero, friction.stribeck_velocity);
  if (friction.present() && system.velocity.size() == 0) {
    plant.refuse(friction.coulomb > 0.0 ? "coulomb_friction" : "breakaway_friction",
                 "friction needs kind = \"mechanical\", which has a velocity for it to act on");
  }
  return friction;
}

void read_controller(const Section& plant, SimulatedRigSettings& rig) {
  const auto section = plant.table("controller");
  if (!section) return;
  ControllerSettings controller;
  controller.proportional = section->number("proportional", any_number, controller.proportional);
  controller.integral = section->number("integral", any_number, controller.integral);
  controller.derivative = section->number("derivative", any_number, controller.derivative);
  controller.derivative_hz =
      section->number("derivative_hz", zero_or_more, controller.derivative_hz);
  const std::string injection = section->choice("inject", {"reference", "plant_input"});
  controller.injection = injection == "reference" ? Injection::reference : Injection::plant_input;
  const std::vector<std::string>& outputs = rig.system.outputs;
  const std::string feedback = section->text("feedback", outputs.front());
  const auto found = std::find(outputs.begin(), outputs.end(), feedback);
  if (found == outputs.end()) section->refuse("feedback", "the plant has no such output");
  rig.feedback = static_cast<std::size_t>(found - outputs.begin());
  if (rig.system.d(static_cast<Eigen::Index>(rig.feedback)) != 0.0) {
    section->refuse("feedback", "must be an output without direct feedthrough from the input");
  }
  rig.controller = controller;
}

ActuatorImperfections read_actuator(const Section& section) {
  ActuatorImperfections actuator;
  actuator.min = section.number("clamp_min", any_number, actuator.min);
  actuator.max = section.number("clamp_max", any_number, actuator.max);
  if (!(actuator.min < actuator.max)) section.refuse("clamp_min", "must be below clamp_max");
  actuator.gain = section.number("gain", any_number, actuator.gain);
  actuator.quantum = section.number("quantum", zero_or_more, actuator.quantum);
  actuator.slew_per_s =
      section.number("slew_limit_per_s", config::above_zero_or_unlimited, actuator.slew_per_s);
  actuator.dropout_fraction =
      section.number("dropout_fraction", fraction_of_one, actuator.dropout_fraction);
  return actuator;
}

// Of the simulated connection, in seconds of the loop.
DriveFaultSettings read_faults(const Section& section) {
  DriveFaultSettings faults;
  const auto ascending = [&](std::string_view key, const std::vector<double>& times) {
    if (!std::is_sorted(times.begin(), times.end())) section.refuse(key, "must ascend");
  };
  if (section.has("trips_at_s")) faults.trips_at_s = section.numbers("trips_at_s", zero_or_more);
  ascending("trips_at_s", faults.trips_at_s);
  faults.failing_arms =
      static_cast<std::uint32_t>(section.integer("failing_arms", {.min = 0.0, .max = 1e6}, 0));
  std::vector<double> times;
  if (section.has("connection_lost_s")) {
    for (const std::vector<double>& row : section.rows("connection_lost_s", zero_or_more)) {
      if (row.size() != 2) section.refuse("connection_lost_s", "every row is [from, to]");
      faults.lost.push_back({.from_s = row[0], .to_s = row[1]});
      times.insert(times.end(), row.begin(), row.end());
    }
  }
  ascending("connection_lost_s", times);
  return faults;
}

constexpr std::string_view error_code = "error_code";

// "output" of a sensor: a row of the plant, or a signal of the loop around it.
void read_signal(const Section& section, const SimulatedRigSettings& rig, SimulatedSensor& sensor) {
  constexpr std::pair<std::string_view, Signal> loop_signals[] = {
      {"error", Signal::error}, {"control", Signal::control}, {"plant_input", Signal::plant_input}};
  const std::vector<std::string>& outputs = rig.system.outputs;
  const std::string name = section.text("output", outputs.front());
  for (const auto& [signal_name, signal] : loop_signals) {
    if (!rig.controller || name != signal_name) continue;
    sensor.signal = signal;
    return;
  }
  if (name == error_code) return;
  const auto found = std::find(outputs.begin(), outputs.end(), name);
  if (found == outputs.end()) {
    std::string names;
    for (const std::string& each : outputs) names += " \"" + each + "\"";
    if (rig.controller) names += " \"error\" \"control\" \"plant_input\"";
    names += " \"error_code\"";
    section.refuse("output", "the plant has no such output; it has" + names);
  }
  sensor.output = static_cast<std::size_t>(found - outputs.begin());
}

SimulatedSensor read_sensor(const Section& section, const SimulatedRigSettings& rig,
                            double period_s) {
  SimulatedSensor sensor;
  read_signal(section, rig, sensor);
  SensorImperfections& wrong = sensor.imperfections;
  wrong.delay_s = section.number("delay_s", {.min = 0.0, .max = 10.0}, wrong.delay_s);
  wrong.jitter_s =
      section.number("jitter_s", {.min = 0.0, .max = period_s, .open_max = true}, wrong.jitter_s);
  wrong.noise_rms = section.number("noise_rms", zero_or_more, wrong.noise_rms);
  wrong.pink_noise_rms = section.number("pink_noise_rms", zero_or_more, wrong.pink_noise_rms);
  wrong.bias = section.number("bias", any_number, wrong.bias);
  wrong.drift_per_s = section.number("drift_per_s", any_number, wrong.drift_per_s);
  wrong.backlash = section.number("backlash", zero_or_more, wrong.backlash);
  wrong.quantum = section.number("quantum", zero_or_more, wrong.quantum);
  wrong.min = section.number("clip_min", any_number, wrong.min);
  wrong.max = section.number("clip_max", any_number, wrong.max);
  if (!(wrong.min < wrong.max)) section.refuse("clip_min", "must be below clip_max");
  wrong.lost_fraction = section.number("lost_fraction", fraction_of_one, wrong.lost_fraction);
  wrong.late_fraction = section.number("late_fraction", fraction_of_one, wrong.late_fraction);
  wrong.stuck_at_s =
      section.number("stuck_at_s", {.min = 0.0, .or_unlimited = true}, wrong.stuck_at_s);
  return sensor;
}

class SimDevice final : public Device {
 public:
  // `codes`: which of the sensors is no output of the plant but the drive's error code.
  SimDevice(SimulatedRigSettings settings, DriveFaultSettings faults, std::vector<bool> codes)
      : settings_{std::move(settings)},
        fault_settings_{std::move(faults)},
        codes_{std::move(codes)} {}

  void open(const Clock& clock) override {
    rig_.emplace(settings_, clock);
    faults_.emplace(fault_settings_, clock);
    for (std::size_t i = 0; i < codes_.size(); ++i) sensors_.push_back(make_sensor(i));
    if (fault_settings_.any()) drive_.emplace(rig_->actuator(), *faults_, settings_.neutral);
  }
  void arm() override { faults_->arm(); }
  std::string fault_reason() const override {
    if (faults_->lost()) return "the connection to the simulated drive is lost";
    return faults_->tripped() ? "the simulated drive has tripped" : "";
  }
  bool measures(std::size_t sensor) const override { return !codes_[sensor]; }
  Actuator* actuator() noexcept override { return drive_ ? &*drive_ : &rig_->actuator(); }
  Sensor& sensor(std::size_t index) noexcept override {
    return sensors_[index] ? *sensors_[index] : rig_->sensor(index);
  }

 private:
  // Null: the plant's own, which nothing stands in front of.
  std::unique_ptr<Sensor> make_sensor(std::size_t index) {
    if (codes_[index]) return std::make_unique<ErrorCode>(*faults_);
    if (!fault_settings_.any()) return nullptr;
    return std::make_unique<FaultySensor>(rig_->sensor(index), *faults_);
  }

  SimulatedRigSettings settings_;
  DriveFaultSettings fault_settings_;
  std::vector<bool> codes_;
  std::optional<SimulatedRig> rig_;
  std::optional<DriveFaults> faults_;
  std::vector<std::unique_ptr<Sensor>> sensors_;
  std::optional<FaultyDrive> drive_;
};

// The plant is integrated in pieces shorter than its fastest state: beyond this many in a tick one
// takes seconds, and no signal ends it.
void refuse_stiff(const Section& plant, const LinearSystem& system, double period_s) {
  constexpr double most_pieces = 1e6;
  if (system.states() == 0) return;
  const double pieces = 2.0 * period_s * system.a.cwiseAbs().rowwise().sum().maxCoeff();
  if (pieces <= most_pieces) return;
  plant.refuse("kind",
               "its fastest state is too fast to be simulated at the rate of the loop; look "
               "for an inertia, a time constant or a denominator next to nothing");
}

std::unique_ptr<Device> configure(const DeviceRequest& request) {
  if (request.actuator == nullptr) {
    request.sensors.front()->section.refuse(
        "driver", "a simulated sensor needs the simulated plant: [actuator] driver = \"sim\"");
  }
  const Section plant = request.rig.file->section("plant");
  SimulatedRigSettings settings;
  settings.system = read_plant(plant);
  settings.friction = read_friction(plant, settings.system);
  refuse_stiff(plant, settings.system, 1.0 / request.rig.rate_hz);
  settings.seed = static_cast<std::uint64_t>(
      plant.integer("seed", {.min = 0.0, .max = 9e15}, static_cast<std::int64_t>(settings.seed)));
  read_controller(plant, settings);
  settings.actuator = read_actuator(request.actuator->section);
  settings.neutral = request.rig.guard.neutral;
  std::vector<bool> codes;
  for (const config::Channel* sensor : request.sensors) {
    codes.push_back(sensor->section.text("output", "") == error_code);
    settings.sensors.push_back(read_sensor(sensor->section, settings, 1.0 / request.rig.rate_hz));
  }
  return std::make_unique<SimDevice>(std::move(settings), read_faults(request.actuator->section),
                                     std::move(codes));
}

}  // namespace

LinearSystem read_plant(const config::Section& plant) {
  LinearSystem system = read_system(plant);
  system.dead_time_s = plant.number("delay_s", {.min = 0.0, .max = 10.0}, 0.0);
  return system;
}

DriverKit sim_driver() {
  return {
      .name = "sim", .summary = "simulated plant in this process, [plant]", .configure = configure};
}

}  // namespace sinerig::sim
