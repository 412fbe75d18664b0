#include "drivers/gpio/gpio_driver.h"

#include <optional>
#include <stdexcept>
#include <utility>

#include "drivers/gpio/gpio_config.h"

namespace sinerig::gpio {
namespace {

class GpioDevice final : public Device {
 public:
  GpioDevice(const DeviceRequest& request, std::function<std::unique_ptr<LineBank>()> bank)
      : make_bank_{std::move(bank)} {
    if (request.actuator != nullptr) output_ = read_output(request.rig);
    for (const config::Channel* sensor : request.sensors)
      inputs_.push_back({sensor->name, read_sensor(*sensor), nullptr, nullptr, nullptr});
  }

  // Inputs first: while they are opened nothing is driven yet.
  void open(const Clock& clock) override {
    const std::unique_ptr<LineBank> bank = make_bank_();
    for (Input& input : inputs_) open(input, *bank, clock);
    if (!output_) return;
    actuator_.emplace(bank->outputs(output_->lines, GpioActuator::safe_levels(output_->settings)),
                      make_modulator(output_->modulator), output_->settings, clock);
  }

  void check_may_arm() const override {
    for (const Input& input : inputs_) {
      if (input.interlock != nullptr && !input.interlock->closed())
        throw std::runtime_error(
            input.name + ": the interlock is open (chip " + input.plan.lines.chip + ", line " +
            input.plan.lines.lines.front().name + " is not active); close it, then start again");
    }
  }

  void keep_released() noexcept override {
    if (actuator_ && !actuator_->released()) actuator_->release();
  }

  std::string not_released() const override {
    if (!actuator_ || actuator_->released()) return "";
    std::string lines;
    for (const Line& line : output_->lines.lines) lines += (lines.empty() ? "" : ", ") + line.name;
    return "the kernel refused to set the lines to their safe levels, they may still drive: " +
           output_->lines.chip + ", " + lines;
  }

  void arm() override { check_may_arm(); }

  void catch_up() override {
    for (const Input& input : inputs_)
      if (input.encoder != nullptr) input.encoder->catch_up();
  }

  std::string fault_reason() const override {
    for (const Input& input : inputs_) {
      const std::string reason = input.encoder != nullptr ? input.encoder->reason() : "";
      if (!reason.empty()) return input.name + ": " + reason;
    }
    return actuator_ ? actuator_->reason() : "";
  }

  std::vector<Remark> remarks() const override {
    std::vector<Remark> remarks;
    for (const Input& input : inputs_) {
      if (input.encoder == nullptr) continue;
      remarks.push_back(
          {.text = input.name + ": " + input.encoder->seen(), .doubts = input.encoder->doubtful()});
    }
    return remarks;
  }

  bool measures(std::size_t index) const override {
    return !std::holds_alternative<InterlockSettings>(inputs_[index].plan.settings);
  }

  Actuator* actuator() noexcept override { return actuator_ ? &*actuator_ : nullptr; }
  Sensor& sensor(std::size_t index) noexcept override { return *inputs_[index].sensor; }

 private:
  struct Input {
    std::string name;
    SensorPlan plan;
    std::unique_ptr<Sensor> sensor;
    Encoder* encoder;      // the sensor, where it is one
    Interlock* interlock;  // likewise
  };

  static void open(Input& input, LineBank& bank, const Clock& clock) {
    if (const auto* encoder = std::get_if<EncoderSettings>(&input.plan.settings)) {
      auto opened = std::make_unique<Encoder>(bank.edges(input.plan.lines), *encoder, clock);
      input.encoder = opened.get();
      input.sensor = std::move(opened);
    } else if (const auto* level = std::get_if<LevelSettings>(&input.plan.settings)) {
      input.sensor = std::make_unique<LevelSensor>(bank.inputs(input.plan.lines), *level, clock);
    } else {
      auto opened = std::make_unique<Interlock>(bank.inputs(input.plan.lines), clock);
      input.interlock = opened.get();
      input.sensor = std::move(opened);
    }
  }

  std::function<std::unique_ptr<LineBank>()> make_bank_;
  std::optional<OutputPlan> output_;
  std::vector<Input> inputs_;
  std::optional<GpioActuator> actuator_;
};

}  // namespace

DriverKit gpio_driver(std::function<std::unique_ptr<LineBank>()> bank) {
  return {.name = "gpio",
          .summary = "GPIO lines: density, sign-magnitude or step outputs; encoders, interlocks",
          .configure =
              [bank = std::move(bank)](const DeviceRequest& request) -> std::unique_ptr<Device> {
            return std::make_unique<GpioDevice>(request, bank);
          }};
}

}  // namespace sinerig::gpio
