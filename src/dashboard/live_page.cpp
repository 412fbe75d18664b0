#include "dashboard/live_page.h"

#include <string_view>

#include "dashboard/page.h"

namespace sinerig::dashboard {

std::shared_ptr<const std::string> live_page() {
  std::string page;
  std::string_view rest = page_template;
  const auto fill = [&](std::string_view mark, std::string_view text) {
    const std::size_t at = rest.find(mark);
    page += rest.substr(0, at);
    page += text;
    rest.remove_prefix(at + mark.size());
  };
  fill("@STYLE@", page_style);
  fill("@SCRIPT@", page_script);
  page += rest;
  return std::make_shared<const std::string>(std::move(page));
}

}  // namespace sinerig::dashboard
