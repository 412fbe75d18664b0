#include "drivers/modbus/exchange.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <tuple>

namespace sinerig::modbus {
namespace {

std::size_t end_of(const Place& place) noexcept {
  return place.address + place.words();
}

bool joins(const Request& question, const Place& place, std::size_t read_through) noexcept {
  const Function function =
      place.table == Table::holding ? Function::read_holding : Function::read_input;
  if (question.unit != place.unit || question.function != function) return false;
  const std::size_t end = question.read_address + std::size_t{question.read_count};
  const std::size_t new_end = std::max(end, end_of(place));
  return place.address <= end + read_through &&
         new_end - question.read_address <= max_read_registers;
}

void write_into(Request& question, const Place& command) {
  question.write_address = command.address;
  question.write_count = static_cast<std::uint16_t>(command.words());
}

}  // namespace

Request reading(const Place& place) {
  Request question;
  question.unit = place.unit;
  question.function = place.table == Table::holding ? Function::read_holding : Function::read_input;
  question.read_address = place.address;
  question.read_count = static_cast<std::uint16_t>(place.words());
  return question;
}

ExchangePlan ExchangePlan::make(const std::vector<Place>& places, const Place* command,
                                Writing writing, std::size_t read_through) {
  if (places.size() > max_fields)
    throw std::invalid_argument("more than " + std::to_string(max_fields) +
                                " numbers are read from one connection");
  ExchangePlan plan;
  plan.fields.resize(places.size());
  std::vector<std::size_t> order(places.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t n) {
    return std::tuple{places[n].unit, places[n].table, places[n].address};
  });
  for (const std::size_t n : order) {
    const Place& place = places[n];
    if (plan.questions.empty() || !joins(plan.questions.back(), place, read_through))
      plan.questions.push_back(reading(place));
    Request& question = plan.questions.back();
    const std::size_t end =
        std::max(question.read_address + std::size_t{question.read_count}, end_of(place));
    question.read_count = static_cast<std::uint16_t>(end - question.read_address);
    plan.fields[n] = {.question = plan.questions.size() - 1,
                      .offset = static_cast<std::size_t>(place.address - question.read_address),
                      .format = place.format};
  }
  if (command == nullptr) return plan;

  // The command goes first: by function 23 with what is read of the same device, else by itself.
  const auto partner = std::ranges::find_if(plan.questions, [&](const Request& question) {
    return question.unit == command->unit && question.function == Function::read_holding;
  });
  const bool at_once = writing == Writing::write_and_read || writing == Writing::automatic;
  if (at_once && partner != plan.questions.end()) {
    partner->function = Function::write_and_read;
    write_into(*partner, *command);
    const auto first = static_cast<std::size_t>(partner - plan.questions.begin());
    std::rotate(plan.questions.begin(), partner, partner + 1);
    for (Field& field : plan.fields) {
      if (field.question == first)
        field.question = 0;
      else if (field.question < first)
        ++field.question;
    }
    return plan;
  }
  Request alone;
  alone.unit = command->unit;
  alone.function = writing == Writing::single ? Function::write_single : Function::write_multiple;
  write_into(alone, *command);
  plan.questions.insert(plan.questions.begin(), alone);
  for (Field& field : plan.fields) ++field.question;
  return plan;
}

std::size_t ExchangePlan::wire_bytes() const noexcept {
  std::size_t bytes = 0;
  for (const Request& question : questions)
    bytes += bytes_of(question).size + 2 + 1 + reply_size(question) + 2;
  return bytes;
}

}  // namespace sinerig::modbus
