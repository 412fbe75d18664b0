#include "record/snippet.h"

#include <cmath>
#include <cstdio>
#include <ostream>

#include "record/point_columns.h"
#include "record/text.h"

namespace sinerig::record {

namespace {

std::string exact(double value, const char* not_a_number) {
  if (!std::isfinite(value)) return not_a_number;
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

// Four numbers a line.
template <typename Value>
void write_numbers(std::ostream& stream, const StoredResponse& response, const char* separator,
                   const char* line_end, const char* not_a_number, Value value) {
  for (std::size_t i = 0; i < response.points.size(); ++i) {
    if (i > 0) stream << separator << (i % 4 == 0 ? line_end : " ");
    stream << exact(value(response.points[i]), not_a_number);
  }
}

double is_good(const StoredPoint& point) {
  return point.status == "good" || point.status == "imported" ? 1.0 : 0.0;
}

void write_remarks(std::ostream& stream, const char* mark, const StoredRun& run,
                   const StoredResponse& response, const std::string& source) {
  const ChannelInfo& input = run.channels.at(response.input);
  const ChannelInfo& output = run.channels.at(response.output);
  stream << mark << " Frequency response of " << source << ", written by sinerig.\n"
         << mark << " output: " << output.name << " [" << output.unit << "]\n"
         << mark << " input: " << input.name << " [" << input.unit << "]\n"
         << mark << ' ' << response_convention << '\n';
  if (response.hold_rate_hz > 0.0)
    stream << mark
           << text(" H holds the zero-order hold of a loop at %.10g Hz.\n", response.hold_rate_hz);
}

}  // namespace

void write_python_snippet(std::ostream& stream, const StoredRun& run,
                          const StoredResponse& response, const std::string& source) {
  write_remarks(stream, "#", run, response, source);
  stream << "import numpy as np\n\n";
  const auto array = [&](const char* name, const char* suffix, auto value) {
    stream << name << " = np.array([\n    ";
    write_numbers(stream, response, ",", "\n    ", "np.nan", value);
    stream << "])" << suffix << '\n';
  };
  array("freq_hz", "", [](const auto& p) { return p.frequency_hz; });
  array("re", "", [](const auto& p) { return p.response.real(); });
  array("im", "", [](const auto& p) { return p.response.imag(); });
  array("var_re", "  # covariance of (re, im)", [](const auto& p) { return p.covariance.re_re; });
  array("cov_re_im", "", [](const auto& p) { return p.covariance.re_im; });
  array("var_im", "", [](const auto& p) { return p.covariance.im_im; });
  array("good", " == 1  # status of the point", is_good);
  stream << "H = re + 1j * im\nomega = 2 * np.pi * freq_hz  # rad/s\n";
  if (response.hold_rate_hz > 0.0)
    stream << "hold_rate_hz = " << exact(response.hold_rate_hz, "0")
           << "\nhold = np.sinc(freq_hz / hold_rate_hz) * np.exp(-0.5j * omega / hold_rate_hz)\n";
  else
    stream << "hold = 1.0  # none is known between input and output\n";
  stream << R"py(

def misfit(num, den, delay_s=0.0):
    """Measured minus model in standard deviations, for the coefficients of scipy.signal.

    The model is the plant without the hold of the loop; the factor of the hold is put in front of
    it here, without its images (a few per cent of G at a tenth of the rate where G falls as 1/w).
    """
    from scipy import signal

    _, G = signal.freqs(num, den, omega)
    return (H - hold * G * np.exp(-1j * omega * delay_s)) / np.sqrt((var_re + var_im) / 2)


try:
    import control

    response = control.FRD(H[good], omega[good])
except ImportError:
    response = None  # pip install control
)py";
}

void write_matlab_snippet(std::ostream& stream, const StoredRun& run,
                          const StoredResponse& response, const std::string& source) {
  write_remarks(stream, "%", run, response, source);
  const auto array = [&](const char* name, auto value) {
    stream << name << " = [ ...\n  ";
    write_numbers(stream, response, ";", " ...\n  ", "NaN", value);
    stream << "];\n";
  };
  array("freq_hz", [](const auto& p) { return p.frequency_hz; });
  array("re", [](const auto& p) { return p.response.real(); });
  array("im", [](const auto& p) { return p.response.imag(); });
  stream << "% covariance of (re, im)\n";
  array("var_re", [](const auto& p) { return p.covariance.re_re; });
  array("cov_re_im", [](const auto& p) { return p.covariance.re_im; });
  array("var_im", [](const auto& p) { return p.covariance.im_im; });
  array("good", is_good);
  stream << R"m(good = good == 1;
H = complex(re, im);
if exist('frd')  % Control System Toolbox, or Octave's control package
  sys = frd(reshape(H(good), 1, 1, []), 2 * pi * freq_hz(good));  % rad/s
end
)m";
}

}  // namespace sinerig::record
