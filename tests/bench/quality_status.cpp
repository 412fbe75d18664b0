// Every planted imperfection gets its status and reason; a clean run has no false one.
#include <algorithm>
#include <cstdio>
#include <functional>
#include <random>
#include <vector>

#include "quality.h"
#include "quality_plants.h"
#include "support/virtual_run.h"

namespace sinerig::quality {

namespace {

constexpr double rate_hz = 1000.0;
constexpr std::uint32_t clean_points = 10000;

// Between two times the sensor's noise is louder.
class BurstSensor final : public Sensor {
 public:
  BurstSensor(Sensor& inner, double rms, double from_s, double to_s, std::uint64_t seed)
      : inner_{inner}, rms_{rms}, from_s_{from_s}, to_s_{to_s}, generator_{seed} {}

  Sample read() noexcept override {
    Sample sample = inner_.read();
    const double seconds = static_cast<double>(reads_++) / rate_hz;
    if (seconds >= from_s_ && seconds < to_s_) sample.value += rms_ * normal_(generator_);
    return sample;
  }

 private:
  Sensor& inner_;
  double rms_;
  double from_s_;
  double to_s_;
  std::uint64_t reads_ = 0;
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
};

struct Planted {
  const char* name;
  PointStatus status;
  PointReason reason;
  std::function<void(sim::SimulatedRigSettings&)> plant;
  double burst_rms = 0.0;
  std::size_t first = 0;  // dwells that it shows in
  std::size_t last = 4;
};

// Five dwells of 1 s and more on a plain second order at 20 dB of signal over noise.
SweepPlan plan_of(Settling settling) {
  SweepSettings sweep;
  sweep.spacing = Spacing::list;
  sweep.frequencies_hz = {4.0, 5.0, 6.0, 7.0, 8.0};
  sweep.amplitude = 1.0;
  sweep.settling = settling;
  if (settling == Settling::fixed) sweep.settle = {.cycles = 1.0, .seconds = 0.2};
  sweep.target_db = 0.06;
  sweep.target_deg = 0.6;
  return plan_sweep(sweep, {}, rate_hz);
}

sim::SimulatedRigSettings clean_rig(const QualityPlant& plant, std::uint64_t seed) {
  sim::SimulatedRigSettings rig;
  rig.system = plant.system;
  rig.sensors.resize(1);
  rig.sensors[0].imperfections.noise_rms = 0.07;
  rig.seed = seed;
  return rig;
}

// What a servo with dry friction at half of its torque does.
void make_sticky(sim::SimulatedRigSettings& rig) {
  sim::MechanicalAxis axis;
  axis.inertia = 0.002;
  axis.damping = 0.15;
  axis.stiffness = 8.0;
  axis.gain = 8.0;
  rig.system = sim::from_mechanical_axis(axis);
  rig.friction.coulomb = 5.0;
  rig.sensors[0].imperfections.noise_rms = 1e-3;
}

std::vector<Planted> planted() {
  const auto sensor = [](double sim::SensorImperfections::*what, double value) {
    return [=](sim::SimulatedRigSettings& rig) {
      rig.sensors[0].imperfections.*what = value;
    };
  };
  return {
      {"noise burst", PointStatus::low_signal, PointReason::noise_burst,
       [](sim::SimulatedRigSettings&) {}, 2.0, 0, 0},
      {"clip", PointStatus::clipped, PointReason::output_at_range,
       sensor(&sim::SensorImperfections::max, 0.8)},
      {"stuck sensor", PointStatus::low_signal, PointReason::stuck,
       sensor(&sim::SensorImperfections::stuck_at_s, 0.0)},
      {"dropout of commands", PointStatus::rt_fault, PointReason::gaps,
       [](sim::SimulatedRigSettings& rig) {
         rig.actuator.dropout_fraction = 0.2;
       }},
      {"dropout of samples", PointStatus::good, PointReason::none,
       sensor(&sim::SensorImperfections::lost_fraction, 0.05)},
      {"friction", PointStatus::distorted, PointReason::harmonics, make_sticky},
      {"slow plant", PointStatus::unsettled, PointReason::still_moving,
       [](sim::SimulatedRigSettings& rig) {
         rig.system = sim::from_zeros_poles({}, {{-0.02, 31.416}}, 987.0);
         rig.sensors[0].imperfections.noise_rms = 1e-3;
       },
       0.0, 1, 1},
      // These two end the sweep within two blocks; the event says which it was.
      {"missing excitation", PointStatus::stopped, PointReason::guard_trip,
       [](sim::SimulatedRigSettings& rig) {
         rig.actuator.gain = 0.0;
       }},
      {"wrong sign", PointStatus::stopped, PointReason::guard_trip,
       [](sim::SimulatedRigSettings& rig) {
         rig.actuator.gain = -1.0;
       }},
  };
}

std::vector<Point> run_with(const SweepPlan& plan, const sim::SimulatedRigSettings& settings,
                            double burst_rms) {
  VirtualClock clock{TickGrid{plan.rate_hz}};
  sim::SimulatedRig rig{settings, clock};
  BurstSensor sensor{rig.sensor(0), burst_rms, 0.7, 0.75, settings.seed};
  Sensor* const sensors[] = {&sensor};
  Guard guard{[] {
                GuardSettings open = test::open_guard(1);
                open.max_write_faults = 0;
                return open;
              }(),
              clock.grid().period_s()};
  test::CollectingSink sink;
  SweepRunner runner{plan, {}, clock, rig.actuator(), sensors, guard, sink};
  RunControl control;
  runner.run(control);
  return sink.points;
}

int planted_rows(const Options& options) {
  const QualityPlant plant = load_plant(options.rigs, "g4");
  int missed = 0;
  for (const Planted& each : planted()) {
    // Where settling is detected a burst is dropped with the transient, and the point is good.
    const SweepPlan plan = plan_of(each.burst_rms > 0.0 ? Settling::fixed : Settling::detect);
    std::vector<std::vector<Point>> runs(options.seeds_or(50));
    in_parallel(runs.size(), options.threads, [&](std::size_t i) {
      sim::SimulatedRigSettings rig = clean_rig(plant, options.first_seed + i);
      each.plant(rig);
      runs[i] = run_with(plan, rig, each.burst_rms);
    });
    std::size_t right = 0;
    std::size_t all = 0;
    const Point* wrong = nullptr;
    for (const auto& points : runs) {
      for (std::size_t i = each.first; i < std::min(points.size(), each.last + 1); ++i) {
        const bool as_planted = points[i].status == each.status && points[i].reason == each.reason;
        right += as_planted ? 1 : 0;
        if (!as_planted) wrong = &points[i];
        ++all;
      }
    }
    const bool met = right == all && all > 0;
    std::printf("%-20s %-11s %-16s %4zu of %4zu   %s", each.name, to_string(each.status),
                to_string(each.reason), right, all, verdict(met));
    if (wrong != nullptr) {
      std::printf("   (else e.g. %s %s, distortion %.3f, %.1f s)", to_string(wrong->status),
                  to_string(wrong->reason), wrong->distortion, wrong->seconds);
    }
    std::printf("\n");
    missed += met ? 0 : 1;
  }
  return missed;
}

int clean_row(const Options& options) {
  std::vector<QualityCase> cases;
  for (const char* name : {"g1", "g3", "g4"}) {
    const QualityPlant plant = load_plant(options.rigs, name);
    for (const Noise noise : {Noise::n80, Noise::n60, Noise::l20}) {
      cases.push_back(make_case(plant, noise));
    }
  }
  const auto rounds =
      options.seeds_or(clean_points / static_cast<std::uint32_t>(60 * cases.size()) + 1);
  std::vector<std::vector<Point>> runs(rounds * cases.size());
  in_parallel(runs.size(), options.threads, [&](std::size_t i) {
    const QualityCase& of = cases[i % cases.size()];
    runs[i] = test::run_virtual(of.plan, of.rig(options.first_seed + i)).sink.points;
  });
  std::size_t points = 0;
  std::size_t marked = 0;
  const Point* example = nullptr;
  for (const auto& run : runs) {
    for (const Point& point : run) {
      ++points;
      if (point.status == PointStatus::good) continue;
      ++marked;
      example = &point;
    }
  }
  std::printf("%-20s %-28s %4zu of %zu marked   %s", "clean", "good", marked, points,
              verdict(marked == 0));
  if (example != nullptr) {
    std::printf("   (e.g. %s %s %.3g at %.1f Hz)", to_string(example->status),
                to_string(example->reason), example->reason_value, example->frequency_hz);
  }
  std::printf("\n");
  return marked == 0 ? 0 : 1;
}

}  // namespace

int status(const Options& options) {
  std::printf("\nStatus and reason of planted imperfections, %u runs each\n\n",
              options.seeds_or(50));
  return planted_rows(options) + clean_row(options);
}

}  // namespace sinerig::quality
