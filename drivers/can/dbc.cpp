#include "drivers/can/dbc.h"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "drivers/can/dbc_parser.h"

namespace sinerig::can {
namespace {

bool same_layout(const DbcMessage& a, const DbcMessage& b) {
  return a.length == b.length && a.extended == b.extended &&
         std::equal(a.signals.begin(), a.signals.end(), b.signals.begin(), b.signals.end(),
                    [](const DbcSignal& x, const DbcSignal& y) {
                      return x.name == y.name && x.signal == y.signal &&
                             x.multiplexed_by == y.multiplexed_by;
                    });
}

bool ends_in(std::string_view name, std::string_view ending) {
  return name.size() > ending.size() && name.ends_with(ending) &&
         name[name.size() - ending.size() - 1] == '_';
}

std::string names_of(const std::vector<DbcSignal>& signals) {
  std::string names;
  for (const DbcSignal& signal : signals)
    names.append(names.empty() ? "" : ", ").append(signal.name);
  return names.empty() ? "none" : names;
}

const DbcSignal* multiplexor_of(const DbcMessage& message, const DbcSignal& signal) {
  if (!signal.multiplexor.empty()) return message.find(signal.multiplexor);
  for (const DbcSignal& candidate : message.signals)
    if (candidate.is_multiplexor && &candidate != &signal) return &candidate;
  return nullptr;
}

}  // namespace

const DbcSignal* DbcMessage::find(std::string_view signal_name) const noexcept {
  for (const DbcSignal& signal : signals)
    if (signal.name == signal_name) return &signal;
  return nullptr;
}

DbcOrigin origin_of(const DbcBinding& binding) {
  const Signal& signal = binding.signal->signal;
  const bool is_integer =
      signal.encoding == Encoding::unsigned_integer || signal.encoding == Encoding::signed_integer;
  return {.name = binding.message->name + "." + binding.signal->name,
          .perhaps_float = is_integer && signal.length == 32 && signal.scale == 1.0};
}

Dbc Dbc::read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf()))
    throw std::runtime_error(path +
                             ": the DBC file cannot be read; check the path (it is relative " +
                             "to the file that names it)");
  return read_text(text.str(), path);
}

Dbc Dbc::read_text(std::string_view text, const std::string& file_name) {
  Dbc dbc;
  dbc.file_name_ = file_name;
  dbc.messages_ = parse_dbc(text, file_name);
  return dbc;
}

const DbcMessage& Dbc::find_message(std::string_view name) const {
  const DbcMessage* best = nullptr;
  for (const DbcMessage& message : messages_) {
    if (message.name == name) return message;
    if (!ends_in(message.name, name)) continue;
    if (best != nullptr && !same_layout(*best, message))
      throw std::runtime_error(file_name_ + ": '" + std::string(name) + "' may be " + best->name +
                               " or " + message.name + ", which differ; give the whole name");
    if (best == nullptr || message.id < best->id) best = &message;
  }
  if (best == nullptr)
    throw std::runtime_error(file_name_ + ": there is no message '" + std::string(name) + "'");
  return *best;
}

DbcBinding Dbc::find(std::string_view name) const {
  const std::size_t dot = name.find('.');
  if (dot == std::string_view::npos)
    throw std::runtime_error(file_name_ + ": signal '" + std::string(name) +
                             "' must be given as Message.Signal");
  DbcBinding binding;
  binding.message = &find_message(name.substr(0, dot));
  binding.signal = binding.message->find(name.substr(dot + 1));
  if (binding.signal == nullptr)
    throw std::runtime_error(file_name_ + ":" + std::to_string(binding.message->line) + ": " +
                             binding.message->name + " has no signal '" +
                             std::string(name.substr(dot + 1)) + "'; it has " +
                             names_of(binding.message->signals));

  const DbcSignal* level = binding.signal;
  while (level->multiplexed_by.has_value()) {
    const std::string where = file_name_ + ":" + std::to_string(level->line) + ": " + level->name;
    if (level->has_multiplex_ranges)
      throw std::runtime_error(where + " is there for several multiplexor values; describe the " +
                               "frame in the rig file instead");
    const DbcSignal* multiplexor = multiplexor_of(*binding.message, *level);
    if (multiplexor == nullptr)
      throw std::runtime_error(where + " is multiplexed but " + binding.message->name +
                               " has no multiplexor (a signal marked M)");
    if (binding.multiplexors.size() > binding.message->signals.size())
      throw std::runtime_error(where + ": the multiplexors select each other in a circle");
    binding.multiplexors.emplace_back(multiplexor, *level->multiplexed_by);
    level = multiplexor;
  }
  return binding;
}

}  // namespace sinerig::can
