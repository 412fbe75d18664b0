#include "sweep/modal_dwell.h"

#include <utility>

namespace sinerig {

namespace {

// A modelled dwell is kept for this long. One that takes longer is limited by noise, not by its
// transient: detection costs little there.
constexpr std::size_t most_stored = std::size_t{1} << 19U;

}  // namespace

ModalDwell::ModalDwell(std::size_t channels, std::vector<std::size_t> outputs, double rate_hz)
    : settling_{std::move(outputs), rate_hz},
      store_{channels, most_stored},
      solver_{make_solver(Deputy::Where::at_once)} {}

std::unique_ptr<Deputy> ModalDwell::make_solver(Deputy::Where where) {
  const auto solve = [this] {
    answer_ = settling_.look(store_, look_count_);
    if (last_look_ && answer_ == ModalVerdict::going_on) settling_.conclude(store_);
  };
  return std::make_unique<Deputy>(solve, where);
}

void ModalDwell::solve_elsewhere() {
  solver_ = make_solver(Deputy::Where::own_thread);
}

void ModalDwell::leave() noexcept {
  live_ = false;
  looking_ = false;
  concluding_ = false;
  verdict_ = ModalVerdict::going_on;
}

void ModalDwell::start(const ModalTask& task) noexcept {
  leave();
  task_ = task;
  live_ = true;
  waiting_ = true;
  if (solver_->idle()) begin();
}

void ModalDwell::begin() noexcept {
  waiting_ = false;
  store_.clear();
  blind_left_ = settling_.prior().blind_ticks;
  ModalTask task = task_;
  task.least_samples = task.least_samples > blind_left_ ? task.least_samples - blind_left_ : 1;
  settling_.start(task);
}

void ModalDwell::add(Phasor tone, std::span<const Observation> observations) noexcept {
  if (!live_ || concluding_) return;
  if (waiting_ && solver_->idle()) begin();
  if (waiting_) return;
  if (blind_left_ > 0) {
    --blind_left_;
    return;
  }
  store_.add(tone, observations);
  if (looking_ && solver_->idle()) hear();
  if (looking_ || !live_) return;
  if (store_.count() < settling_.next_look() && !store_.full()) return;
  look();
}

void ModalDwell::look() noexcept {
  look_count_ = store_.count();
  last_look_ = concluding_;
  looking_ = true;
  solver_->ask();
  if (solver_->idle()) hear();
}

void ModalDwell::hear() noexcept {
  looking_ = false;
  verdict_ = answer_;
  modes_ = settling_.prior();
  live_ = verdict_ == ModalVerdict::going_on;
}

bool ModalDwell::concluded() noexcept {
  if (!live_ || waiting_) return true;
  if (looking_ && !solver_->idle()) return false;
  if (looking_) hear();
  if (live_ && !concluding_) {
    concluding_ = true;
    look();
  }
  return !looking_;
}

bool ModalDwell::conclude() noexcept {
  return concluded() && !waiting_ && (live_ || accepted()) && settling_.result(0).known;
}

}  // namespace sinerig
