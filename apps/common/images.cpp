// images.cpp -- see images.h.
#include "common/images.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <utility>

#include "common/files.h"
#include "common/jpeg_check.h"
#include "diagnostics/error.h"

namespace apps {

using retrograde::text;

namespace {

[[noreturn]] void refuse_read(const std::filesystem::path& path, const std::string& rule,
                              std::string evidence, const std::string& instead) {
  // Joins the decoder's message to one line.
  std::replace(evidence.begin(), evidence.end(), '\n', ' ');
  while (!evidence.empty() && (evidence.back() == ' ' || evidence.back() == '.'))
    evidence.pop_back();
  retrograde::call_error(text("read ", retrograde::quoted(path.string())), rule, evidence, instead);
}

// Decoders' libraries also print their errors to standard error; this silences them during its lifetime.
class QuietErrors {
 public:
  QuietErrors() : kept_(::dup(STDERR_FILENO)) {
    const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (kept_ >= 0 && nowhere >= 0) ::dup2(nowhere, STDERR_FILENO);
    if (nowhere >= 0) ::close(nowhere);
  }
  ~QuietErrors() {
    if (kept_ < 0) return;
    ::dup2(kept_, STDERR_FILENO);
    ::close(kept_);
  }
  QuietErrors(const QuietErrors&) = delete;
  QuietErrors& operator=(const QuietErrors&) = delete;

 private:
  int kept_;
};

constexpr const char *whole_rule = "an input must be a whole image",
                     *fetch_again = "The file is damaged or truncated: fetch it again";

// `raw_mosaic`: opens a RAW file as the sensor's samples, not demosaiced and not turned: OpenImageIO 2.4 would change
// the width without moving the samples.
std::unique_ptr<OIIO::ImageInput> open_image(const std::filesystem::path& path,
                                             bool raw_mosaic = false) {
  std::error_code failed;
  if (!std::filesystem::is_regular_file(path, failed)) {
    refuse_read(path, "an input must be an image file",
                failed ? failed.message() : std::string("no regular file has that name"),
                "Give the name of an existing image");
  }
  OIIO::ImageSpec config;
  config["oiio:UnassociatedAlpha"] = 1;  // colours as stored, not multiplied by alpha
  if (raw_mosaic) {
    config["raw:Demosaic"] = "none";
    config["raw:user_flip"] = 0;
  }
  auto input = OIIO::ImageInput::open(path.string(), &config);
  if (!input) {
    refuse_read(path, "an input must be an image that OpenImageIO decodes", OIIO::geterror(),
                "Give a PNG, JPEG, TIFF, OpenEXR or similar file");
  }
  if (std::string(input->format_name()) == "jpeg") {
    if (const std::string damage = jpeg_damage(path); !damage.empty())
      refuse_read(path, whole_rule, damage, fetch_again);
  }
  return input;
}

void check_size(const std::filesystem::path& path, const OIIO::ImageSpec& spec) {
  const long pixels = static_cast<long>(spec.width) * spec.height;
  const std::string size = text("it has ", spec.width, " x ", spec.height, " pixels of ",
                                spec.nchannels, " channels in ", spec.depth, " slices");
  if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1 || spec.depth > 1) {
    refuse_read(path, "an input must be a flat image with pixels", size, "Give a photograph");
  }
  if (pixels > max_pixels) {
    refuse_read(path, text("an input may have up to ", max_pixels, " pixels"), size,
                "Make it smaller first");
  }
}

int sample_bits(const OIIO::ImageSpec& spec) {
  if (spec.format.is_floating_point()) return 32;
  return spec.format.basesize() > 1 ? 16 : 8;
}

// Reads the first `channels` channels of the file; every sample must be finite.
Image read_open(const std::filesystem::path& path, OIIO::ImageInput& input, int channels) {
  const OIIO::ImageSpec spec = input.spec();
  Image image{spec.width, spec.height, sample_bits(spec), {}, channels};
  image.pixels.resize(image.elems());
  if (!input.read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT, image.pixels.data())) {
    refuse_read(path, whole_rule, input.geterror(), fetch_again);
  }
  const auto bad = std::find_if(image.pixels.begin(), image.pixels.end(),
                                [](float v) { return !std::isfinite(v); });
  if (bad != image.pixels.end()) {
    const long pixel = (bad - image.pixels.begin()) / channels;
    refuse_read(path, "every sample must be a finite number",
                text("pixel (", pixel % image.width, ", ", pixel / image.width, ") holds ", *bad),
                "Mend the image first");
  }
  return image;
}

// The EXIF orientation (JEITA CP-3451, tag 274): 1 is upright. It is also 1 for RAW files, because their decoder turns
// demosaiced images.
int orientation_of(const OIIO::ImageInput& input) {
  return input.spec().get_int_attribute("Orientation", 1);
}

// The rotation that a RAW file's decoder would apply. It reports this number of LibRaw's only if it is not told to
// leave the image unturned.
int orientation_of_mosaic(const std::filesystem::path& path, const OIIO::ImageInput& input) {
  if (std::string(input.format_name()) != "raw") return orientation_of(input);
  const auto turned = OIIO::ImageInput::open(path.string());
  const int flip = turned ? turned->spec().get_int_attribute("raw:flip", 0) : 0;
  return flip == 3 ? 3 : flip == 5 ? 8 : flip == 6 ? 6 : 1;
}

// OpenImageIO 2.4 names patterns clockwise; later versions name them row by row, as here. If LibRaw distinguishes the
// two greens, 2.4 mistakes their numbers for complementary colours, which sensors have not had since 2001.
std::string bayer_pattern(const std::string& named) {
  static const std::pair<const char*, const char*> names[] = {
      {"RGBG", "RGGB"}, {"GMCY", "RGGB"}, {"GRGB", "GRBG"}, {"BGRG", "BGGR"}, {"GBGR", "GBRG"},
      {"RGGB", "RGGB"}, {"GRBG", "GRBG"}, {"BGGR", "BGGR"}, {"GBRG", "GBRG"}};
  for (const auto& [from, to] : names) {
    if (named == from) return to;
  }
  return {};
}

Image spread_gray(const Image& gray) {
  Image image{gray.width, gray.height, gray.bits, {}};
  image.pixels.resize(image.elems());
  for (size_t n = 0; n < image.pixels.size(); ++n) image.pixels[n] = gray.pixels[n / 3];
  return image;
}

std::string lower_suffix(const std::filesystem::path& path) {
  std::string suffix = path.extension().string();
  for (char& c : suffix) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return suffix;
}

// The sample type that files with this suffix store.
OIIO::TypeDesc stored_type(const std::filesystem::path& path, const std::string& suffix, int bits) {
  if (suffix == ".exr" || suffix == ".tif" || suffix == ".tiff" || suffix == ".hdr")
    return OIIO::TypeDesc::FLOAT;
  if (suffix == ".png") return bits > 8 ? OIIO::TypeDesc::UINT16 : OIIO::TypeDesc::UINT8;
  if (suffix == ".jpg" || suffix == ".jpeg") return OIIO::TypeDesc::UINT8;
  retrograde::call_error(
      text("write ", retrograde::quoted(path.string())), "an image's suffix selects its format",
      suffix.empty() ? "it has none" : text("the format ", suffix, " is unknown"),
      "Give .png, .exr, .tif, .hdr or .jpg");
}

[[noreturn]] void refuse_encoding(const std::filesystem::path& path, const std::string& suffix,
                                  std::string evidence) {
  while (!evidence.empty() && evidence.back() == '\n') evidence.pop_back();
  retrograde::call_error(text("write ", retrograde::quoted(path.string())),
                         text("OpenImageIO must be able to encode ", suffix, " of such an image"),
                         evidence, "Give another suffix, or install OpenImageIO with that plugin");
}

// Encodes in memory, so that only write_file, which checks every call, writes to disk. Plugins that cannot do that use
// a scratch file.
std::string encode(const std::filesystem::path& path, const std::string& suffix,
                   const Image& image) {
  const OIIO::ImageSpec spec(image.width, image.height, image.channels,
                             stored_type(path, suffix, image.bits));
  auto output = OIIO::ImageOutput::create(suffix.substr(1));
  if (!output) refuse_encoding(path, suffix, OIIO::geterror());
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  const bool in_memory = output->supports("ioproxy");
  std::string scratch =
      (std::filesystem::temp_directory_path() / ("image.XXXXXX" + suffix)).string();
  if (in_memory) {
    output->set_ioproxy(&memory);
  } else {
    const int file = ::mkstemps(scratch.data(), static_cast<int>(suffix.size()));
    if (file >= 0) ::close(file);
  }
  const bool good = output->open(in_memory ? path.filename().string() : scratch, spec) &&
                    output->write_image(OIIO::TypeDesc::FLOAT, image.pixels.data()) &&
                    output->close();
  const std::string evidence = good ? std::string() : output->geterror();
  output.reset();
  std::string whole(bytes.begin(), bytes.end());
  if (!in_memory) {
    std::ifstream file(scratch, std::ios::binary);
    whole.assign(std::istreambuf_iterator<char>(file), {});
    ::unlink(scratch.c_str());
  }
  if (!good) refuse_encoding(path, suffix, evidence);
  return whole;
}

}  // namespace

Image read_image(const std::filesystem::path& path) {
  const QuietErrors quiet;
  const auto input = open_image(path);
  check_size(path, input->spec());
  // Images of one or two channels are gray (with alpha); of more channels, the first three are the colours.
  const bool gray = input->spec().nchannels < 3;
  const Image image = upright(read_open(path, *input, gray ? 1 : 3), orientation_of(*input));
  return gray ? spread_gray(image) : image;
}

Image read_channels(const std::filesystem::path& path) {
  const QuietErrors quiet;
  const auto input = open_image(path);
  check_size(path, input->spec());
  return upright(read_open(path, *input, input->spec().nchannels), orientation_of(*input));
}

Mosaic read_mosaic(const std::filesystem::path& path) {
  const QuietErrors quiet;
  const auto input = open_image(path, true);
  const OIIO::ImageSpec& spec = input->spec();
  check_size(path, spec);
  if (spec.nchannels != 1) {
    refuse_read(path, "a mosaic has one channel, as a sensor or a gray image has",
                text("it has ", spec.nchannels), "Give a RAW photograph or a gray image");
  }
  return {read_open(path, *input, 1), bayer_pattern(spec.get_string_attribute("raw:FilterPattern")),
          orientation_of_mosaic(path, *input)};
}

std::vector<std::filesystem::path> images_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> found;
  std::error_code failed;
  for (const auto& entry : std::filesystem::directory_iterator(folder, failed)) {
    const QuietErrors quiet;
    if (entry.is_regular_file() && OIIO::ImageInput::open(entry.path().string()))
      found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end());
  OIIO::geterror();  // drop its messages about other files
  if (!found.empty()) return found;
  retrograde::call_error(text("read images of ", retrograde::quoted(folder.string())),
                         "it must be a folder with images in it",
                         failed ? failed.message() : std::string("none of its files is an image"),
                         "Give a folder of photographs");
}

namespace {

// The weights of a result pixel for the pixels of a line from `first` on; they sum to 1.
struct Tap {
  int first;
  std::vector<float> weights;
};

std::vector<Tap> taps_of(int from, int to) {
  std::vector<Tap> taps;
  const double step = static_cast<double>(from) / to, reach = std::max(step, 1.0);
  for (int n = 0; n < to; ++n) {
    const double middle = (n + 0.5) * step - 0.5;
    Tap tap{static_cast<int>(std::ceil(middle - reach)), {}};
    double sum = 0;
    for (int k = tap.first; k <= middle + reach; ++k) {
      const double weight = std::max(1 - std::abs(k - middle) / reach, 0.0);
      tap.weights.push_back(static_cast<float>(weight));
      sum += weight;
    }
    for (float& weight : tap.weights) weight /= static_cast<float>(sum);
    taps.push_back(std::move(tap));
  }
  return taps;
}

// Resizes along x and transposes, so that two calls resize along both axes.
Image resized_and_transposed(const Image& image, int width) {
  Image out{image.height, width, image.bits, {}, image.channels};
  out.pixels.resize(out.elems());
  const std::vector<Tap> taps = taps_of(image.width, width);
  const int channels = image.channels;
  for (int x = 0; x < width; ++x) {
    const Tap& tap = taps[x];
    for (int y = 0; y < image.height; ++y) {
      float* to = &out.pixels[(static_cast<size_t>(x) * image.height + y) * channels];
      for (size_t k = 0; k < tap.weights.size(); ++k) {
        const int at = std::clamp(tap.first + static_cast<int>(k), 0, image.width - 1);
        const float* from = &image.pixels[(static_cast<size_t>(y) * image.width + at) * channels];
        for (int c = 0; c < channels; ++c) to[c] += tap.weights[k] * from[c];
      }
    }
  }
  return out;
}

}  // namespace

// From orientation 5 on, rows are stored as columns; x, y or both may run backwards.
Image upright(Image image, int orientation) {
  if (orientation < 2 || orientation > 8) return image;
  const bool swaps = orientation >= 5;
  const bool back_x = orientation == 2 || orientation == 3 || orientation >= 7,
             back_y = orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
  Image out{swaps ? image.height : image.width,
            swaps ? image.width : image.height,
            image.bits,
            {},
            image.channels};
  out.pixels.reserve(image.pixels.size());
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      const int u = swaps ? y : x, v = swaps ? x : y;
      const size_t column = static_cast<size_t>(back_x ? image.width - 1 - u : u),
                   row = static_cast<size_t>(back_y ? image.height - 1 - v : v);
      const auto from = image.pixels.begin() +
                        static_cast<long>((row * static_cast<size_t>(image.width) + column) *
                                          static_cast<size_t>(image.channels));
      out.pixels.insert(out.pixels.end(), from, from + image.channels);
    }
  }
  return out;
}

Image resized(const Image& image, int width, int height) {
  return resized_and_transposed(resized_and_transposed(image, width), height);
}

void write_image(const std::filesystem::path& path, const Image& image) {
  write_file(path, encode(path, lower_suffix(path), image));
}

void write_png(const std::filesystem::path& path, const Image& image) {
  write_file(path, encode(path, ".png", image));
}

}  // namespace apps
