// images.cpp -- see images.h.
#include "common/images.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "common/files.h"
#include "diagnostics/error.h"

namespace apps {

using retrograde::text;

namespace {

[[noreturn]] void refuse_read(const std::filesystem::path& path, const std::string& rule,
                              std::string evidence, const std::string& instead) {
  // One line, whatever the decoder says.
  std::replace(evidence.begin(), evidence.end(), '\n', ' ');
  while (!evidence.empty() && (evidence.back() == ' ' || evidence.back() == '.'))
    evidence.pop_back();
  retrograde::call_error(text("read ", retrograde::quoted(path.string())), rule, evidence, instead);
}

// Decoders' libraries print to standard error what they also report: silent while this lives.
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

std::unique_ptr<OIIO::ImageInput> open_image(const std::filesystem::path& path) {
  std::error_code failed;
  if (!std::filesystem::is_regular_file(path, failed)) {
    refuse_read(path, "an input must be an image file",
                failed ? failed.message() : std::string("no regular file has that name"),
                "Give the name of an existing image");
  }
  OIIO::ImageSpec config;
  config["oiio:UnassociatedAlpha"] = 1;  // colours as stored, not multiplied by alpha
  auto input = OIIO::ImageInput::open(path.string(), &config);
  if (!input) {
    refuse_read(path, "an input must be an image that OpenImageIO decodes", OIIO::geterror(),
                "Give a PNG, JPEG, TIFF, OpenEXR or similar file");
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

// One or two channels are gray and alpha; of more, the first three are the colours.
void spread_channels(const std::vector<float>& from, int channels, std::vector<float>& to) {
  const size_t pixels = from.size() / channels;
  for (size_t p = 0; p < pixels; ++p) {
    for (int c = 0; c < 3; ++c) to[3 * p + c] = from[p * channels + (channels < 3 ? 0 : c)];
  }
}

}  // namespace

Image read_image(const std::filesystem::path& path) {
  const QuietErrors quiet;
  auto input = open_image(path);
  const OIIO::ImageSpec spec = input->spec();
  check_size(path, spec);
  Image image{spec.width, spec.height, sample_bits(spec), {}};
  const int channels = std::min(spec.nchannels, spec.nchannels < 3 ? 1 : 3);
  image.pixels.resize(image.elems());
  std::vector<float> raw(static_cast<size_t>(spec.width) * spec.height * channels);
  if (!input->read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT, raw.data())) {
    refuse_read(path, "an input must be a whole image", input->geterror(),
                "The file is damaged or truncated: fetch it again");
  }
  spread_channels(raw, channels, image.pixels);
  const auto bad = std::find_if(image.pixels.begin(), image.pixels.end(),
                                [](float v) { return !std::isfinite(v); });
  if (bad != image.pixels.end()) {
    const long pixel = (bad - image.pixels.begin()) / 3;
    refuse_read(path, "every sample must be a finite number",
                text("pixel (", pixel % image.width, ", ", pixel / image.width, ") holds ", *bad),
                "Mend the image first");
  }
  return image;
}

void write_png(const std::filesystem::path& path, const Image& image) {
  const bool deep = image.bits > 8;
  OIIO::ImageSpec spec(image.width, image.height, 3,
                       deep ? OIIO::TypeDesc::UINT16 : OIIO::TypeDesc::UINT8);
  // Encoded in memory, so that only write_file, which checks every call, touches the disk.
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  auto output = OIIO::ImageOutput::create("png");
  if (!output || !output->set_ioproxy(&memory) || !output->open(path.filename().string(), spec) ||
      !output->write_image(OIIO::TypeDesc::FLOAT, image.pixels.data()) || !output->close()) {
    retrograde::call_error(
        text("write ", retrograde::quoted(path.string())), "OpenImageIO must be able to encode PNG",
        output ? output->geterror() : OIIO::geterror(), "Install OpenImageIO with its PNG plugin");
  }
  output.reset();
  write_file(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace apps
