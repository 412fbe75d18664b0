// A shipped profile as a rig file would use it.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>

#include "drivers/can/can_config.h"

namespace sinerig::can {

inline const std::string devices = std::string(SINERIG_SOURCE_DIR) + "/config/devices";

// Its parts, as a rig file with this node would have them.
struct Profile {
  std::unique_ptr<config::RigFile> file;
  std::uint32_t node;

  Profile(const std::string& name, std::uint32_t node_)
      : file(config::RigFile::load(devices + "/" + name)), node(node_) {}

  Keys part(const std::string& kind, const std::string& name) const {
    for (const config::Section& section : file->children(kind))
      if (section.name() == kind + "." + name) return Keys{section, devices};
    throw std::out_of_range(kind + "." + name);
  }
  ConfigReader reader() const { return {Keys{file->section("device"), devices}, node}; }
  CommandSettings command(const std::string& name) const {
    return reader().command(part("command", name), 0.0);
  }
  FeedbackSettings feedback(const std::string& name) const {
    return reader().feedback(part("feedback", name));
  }
};

// A channel of a shipped profile with these keys of a rig file over it.
struct Laid {
  Profile profile;
  std::unique_ptr<config::RigFile> rig;
  std::string kind;
  std::string name;

  Laid(const std::string& file, std::string kind_, std::string name_, const std::string& keys,
       std::uint32_t node = 1)
      : profile(file, node),
        rig(config::RigFile::parse("[c]\n" + keys, "rig.toml")),
        kind(std::move(kind_)),
        name(std::move(name_)) {}
  Keys keys() const { return {rig->section("c"), ".", profile.part(kind, name).base(), devices}; }
  CommandSettings command() const { return profile.reader().command(keys(), 0.0); }
  FeedbackSettings feedback() const { return profile.reader().feedback(keys()); }
};

}  // namespace sinerig::can
