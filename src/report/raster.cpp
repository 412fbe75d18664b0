#include "report/raster.h"

#include <librsvg/rsvg.h>
#include <memory>
#include <stdexcept>

namespace sinerig::report {

namespace {

cairo_status_t append(void* bytes, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

[[noreturn]] void fail(GError* error) {
  const std::string reason = error != nullptr ? error->message : "unknown error";
  if (error != nullptr) g_error_free(error);
  throw std::runtime_error("the picture cannot be drawn: " + reason);
}

}  // namespace

bool has_raster() noexcept {
  return true;
}

std::string png_from_svg(const std::string& svg, double scale) {
  GError* error = nullptr;
  const std::unique_ptr<RsvgHandle, decltype(&g_object_unref)> handle{
      rsvg_handle_new_from_data(reinterpret_cast<const guint8*>(svg.data()), svg.size(), &error),
      g_object_unref};
  if (handle == nullptr) fail(error);
  double width = 0.0;
  double height = 0.0;
  if (!rsvg_handle_get_intrinsic_size_in_pixels(handle.get(), &width, &height)) fail(nullptr);
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface{
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(width * scale),
                                 static_cast<int>(height * scale)),
      cairo_surface_destroy};
  const std::unique_ptr<cairo_t, decltype(&cairo_destroy)> context{cairo_create(surface.get()),
                                                                   cairo_destroy};
  const RsvgRectangle viewport{0.0, 0.0, width * scale, height * scale};
  if (!rsvg_handle_render_document(handle.get(), context.get(), &viewport, &error)) fail(error);
  std::string bytes;
  cairo_surface_write_to_png_stream(surface.get(), append, &bytes);
  return bytes;
}

}  // namespace sinerig::report
