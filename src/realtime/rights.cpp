#include "realtime/rights.h"

#include <algorithm>
#include <iterator>

namespace sinerig::realtime {

const char* to_string(Right right) noexcept {
  switch (right) {
    case Right::scheduling: return "scheduling";
    case Right::cpu: return "cpu";
    case Right::memory: return "memory";
    case Right::heap: return "heap";
    case Right::idle_states: return "idle_states";
    case Right::timer_slack: return "timer_slack";
  }
  return "unknown";
}

Grants missing(const Grants& grants) {
  Grants found;
  std::copy_if(grants.begin(), grants.end(), std::back_inserter(found),
               [](const Grant& grant) { return !grant.granted; });
  return found;
}

bool capabilities_would_help(const Grants& grants) {
  return std::any_of(grants.begin(), grants.end(), [](const Grant& grant) {
    return !grant.granted && (grant.right == Right::scheduling || grant.right == Right::memory);
  });
}

std::string describe_missing(const Grants& grants, const std::string& indent) {
  std::string text;
  for (const Grant& grant : missing(grants)) {
    text += '\n' + indent + to_string(grant.right) + ": " + grant.state;
    if (!grant.remedy.empty()) text += "; " + grant.remedy;
  }
  return text;
}

rlim_t raise_soft_limit(int resource) {
  rlimit limit{};
  getrlimit(resource, &limit);
  limit.rlim_cur = limit.rlim_max;
  setrlimit(resource, &limit);
  getrlimit(resource, &limit);
  return limit.rlim_cur;
}

}  // namespace sinerig::realtime
