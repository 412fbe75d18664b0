// The page that a watcher's browser loads; its data come in afterwards.
#pragma once

#include <memory>
#include <string>

namespace sinerig::dashboard {

std::shared_ptr<const std::string> live_page();

}  // namespace sinerig::dashboard
