// Any bytes as a request to the live page: an answer, and nothing in it that was not sent.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "dashboard/http_request.h"

namespace {

using namespace sinerig::dashboard;

void require(bool holds) {
  if (!holds) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes{reinterpret_cast<const char*>(data), size};
  HttpRequest request;
  const Parsed parsed = parse_request(bytes, request);
  require(parsed != Parsed::incomplete || size < longest_request);
  if (parsed != Parsed::complete) return 0;
  require(!request.method.empty() && request.path.front() == '/');
  require(bytes.find(request.path) != std::string_view::npos);
  require(bytes.find(request.token) != std::string_view::npos);
  require(query_value(request.query, "since").size() <= request.query.size());
  // More behind a whole request changes nothing in it.
  HttpRequest again;
  const std::string longer = std::string{bytes} + "rest";
  require(parse_request(longer, again) == Parsed::complete && again.path == request.path);
  return 0;
}
