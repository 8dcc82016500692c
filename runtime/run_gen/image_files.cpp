#include "run_gen/image_files.h"

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>
#include <vector>

#ifdef RETROGRADE_RUN_GEN_PNG
#include <png.h>
#endif

#include "retrograde_runtime.h"
#ifdef RETROGRADE_RUN_GEN_JPEG
#include "run_gen/jpeg_file.h"
#endif

namespace retrograde::run_gen {

namespace {

std::string extension(const std::string& path) {
  const size_t dot = path.rfind('.');
  return dot == std::string::npos ? "" : path.substr(dot + 1);
}

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
  throw Problem("the file \"" + path + "\" " + why);
}

std::string contents_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) refuse(path, "cannot be read");
  return {std::istreambuf_iterator<char>(in), {}};
}

// A dense image over the bytes, dimension 0 innermost.
Image dense(const std::string& path, halide_type_t type, const std::vector<int>& extents,
            const std::string& bytes, size_t first) {
  Image image(type, extents);
  if (bytes.size() < first || bytes.size() - first < image.size_in_bytes())
    refuse(path, "is truncated");
  if (image.size_in_bytes() > 0)
    std::memcpy(image.data(), bytes.data() + first, image.size_in_bytes());
  return image;
}

// ---- .tmp ----

halide_type_t type_of_code(const std::string& path, int32_t code) {
  constexpr halide_type_code_t f = halide_type_float, u = halide_type_uint, i = halide_type_int;
  constexpr std::pair<halide_type_code_t, int> types[] = {
      {f, 32}, {f, 64}, {u, 8}, {i, 8}, {u, 16}, {i, 16}, {u, 32}, {i, 32}, {u, 64}, {i, 64}};
  if (code < 0 || code >= 10) refuse(path, "has elements of an unknown type");
  return {types[code].first, static_cast<uint8_t>(types[code].second)};
}

Image read_tmp(const std::string& path) {
  const std::string bytes = contents_of(path);
  int32_t words[5];
  if (bytes.size() < sizeof words) refuse(path, "is truncated");
  std::memcpy(words, bytes.data(), sizeof words);
  for (int d = 0; d < 4; d++) {
    if (words[d] < 1) refuse(path, "has an extent below 1");
  }
  return dense(path, type_of_code(path, words[4]), {words[0], words[1], words[2], words[3]}, bytes,
               sizeof words);
}

// ---- .npy: version 1, as NumPy and debug_to_file write it ----

// The value after 'key': in the header.
std::string npy_field(const std::string& path, const std::string& header, const std::string& key) {
  const size_t at = header.find("'" + key + "':");
  if (at == std::string::npos) refuse(path, "has no " + key);
  size_t begin = at + key.size() + 3;
  while (begin < header.size() && header[begin] == ' ') begin++;
  const char last = header[begin] == '(' ? ')' : ',';
  return header.substr(begin, header.find(last, begin) - begin);
}

halide_type_t npy_type(const std::string& path, const std::string& descr) {
  if (descr.size() < 5) refuse(path, "has elements of an unknown type");
  const char kind = descr[2];
  const int bytes = std::atoi(descr.c_str() + 3);
  if (descr[1] == '>' && bytes > 1) refuse(path, "is big-endian");
  if (kind == 'b') return {halide_type_uint, 1};
  if (kind != 'f' && kind != 'i' && kind != 'u') refuse(path, "has elements of an unknown type");
  return {kind == 'f'   ? halide_type_float
          : kind == 'i' ? halide_type_int
                        : halide_type_uint,
          static_cast<uint8_t>(8 * bytes)};
}

Image read_npy(const std::string& path) {
  const std::string bytes = contents_of(path);
  if (bytes.size() < 10 || bytes.compare(0, 6, "\x93NUMPY") != 0)
    refuse(path, "is not a .npy file");
  const bool is_long = bytes[6] >= 2;
  const size_t length = static_cast<uint8_t>(bytes[8]) + 256u * static_cast<uint8_t>(bytes[9]);
  const size_t first = (is_long ? 12 : 10) + length;
  if (bytes.size() < first) refuse(path, "is truncated");
  const std::string header = bytes.substr(0, first);
  std::vector<int> extents;
  for (const std::string& word : split(npy_field(path, header, "shape").substr(1), ',')) {
    if (word.find_first_of("0123456789") != std::string::npos)
      extents.push_back(std::atoi(word.c_str()));
  }
  const bool is_fortran = npy_field(path, header, "fortran_order") == "True";
  if (!is_fortran) extents = {extents.rbegin(), extents.rend()};  // the last one is innermost
  return dense(path, npy_type(path, npy_field(path, header, "descr")), extents, bytes, first);
}

// ---- .pgm, .ppm ----

Image read_pnm(const std::string& path) {
  std::istringstream in(contents_of(path));
  std::string magic;
  in >> magic;
  const auto number = [&] {
    int value = 0;
    while ((in >> std::ws).peek() == '#') in.ignore(std::numeric_limits<int>::max(), '\n');
    if (!(in >> value) || value < 1) refuse(path, "has no sizes");
    return value;
  };
  if (magic != "P5" && magic != "P6") refuse(path, "is not a binary .pgm or .ppm file");
  const int width = number(), height = number(), largest = number(),
            channels = magic == "P6" ? 3 : 1;
  in.get();
  const bool is_wide = largest > 255;
  Image image(halide_type_t(halide_type_uint, is_wide ? 16 : 8),
              std::vector<int>{width, height, channels});
  const auto next = [&] {
    const int high = is_wide ? in.get() : 0, low = in.get();
    if (!in) refuse(path, "is truncated");
    return 256 * high + low;
  };
  for (int y = 0; y < height; y++) {
    for (int x = 0; x < width; x++) {
      for (int c = 0; c < channels; c++) {
        const int value = next();
        if (is_wide)
          image.as<uint16_t>()(x, y, c) = static_cast<uint16_t>(value);
        else
          image.as<uint8_t>()(x, y, c) = static_cast<uint8_t>(value);
      }
    }
  }
  return image;
}

template <typename T>
void write_samples(const Image& image, int channels, std::ostream& out) {
  const auto& pixels = image.as<const T>();
  for (int y = 0; y < image.dim(1).extent(); y++) {
    for (int x = 0; x < image.dim(0).extent(); x++) {
      for (int c = 0; c < channels; c++) {
        const int value = pixels(x + image.dim(0).min(), y + image.dim(1).min(), c);
        if (sizeof(T) == 2) out.put(static_cast<char>(value >> 8));
        out.put(static_cast<char>(value & 255));
      }
    }
  }
}

void write_pnm(const std::string& path, const Image& image) {
  const int channels = image.dim(2).extent();
  if (channels != (extension(path) == "ppm" ? 3 : 1))
    refuse(path, "holds " + std::string(channels == 1 ? "3 channels" : "1 channel") +
                     "; the output has " + std::to_string(channels));
  std::ofstream out(path, std::ios::binary);
  out << (channels == 3 ? "P6" : "P5") << "\n"
      << image.dim(0).extent() << " " << image.dim(1).extent() << "\n"
      << (image.type().bits == 16 ? 65535 : 255) << "\n";
  if (image.type().bits == 16)
    write_samples<uint16_t>(image, channels, out);
  else
    write_samples<uint8_t>(image, channels, out);
  if (!out.flush()) refuse(path, "cannot be written");
}

// ---- .png, 8 bits ----

#ifdef RETROGRADE_RUN_GEN_PNG
struct PngImage {
  png_image header = {};
  PngImage() { header.version = PNG_IMAGE_VERSION; }
  ~PngImage() { png_image_free(&header); }
};

png_uint_32 png_format(int channels) {
  return channels == 1   ? PNG_FORMAT_GRAY
         : channels == 2 ? PNG_FORMAT_GA
         : channels == 3 ? PNG_FORMAT_RGB
                         : PNG_FORMAT_RGBA;
}

Image read_png(const std::string& path) {
  PngImage png;
  if (!png_image_begin_read_from_file(&png.header, path.c_str()))
    refuse(path, std::string("cannot be read: ") + png.header.message);
  const bool has_colour = png.header.format & PNG_FORMAT_FLAG_COLOR,
             has_alpha = png.header.format & PNG_FORMAT_FLAG_ALPHA;
  const int channels = (has_colour ? 3 : 1) + (has_alpha ? 1 : 0);
  png.header.format = png_format(channels);
  auto image = Halide::Runtime::Buffer<uint8_t>::make_interleaved(
      static_cast<int>(png.header.width), static_cast<int>(png.header.height), channels);
  if (!png_image_finish_read(&png.header, nullptr, image.data(), 0, nullptr))
    refuse(path, std::string("cannot be read: ") + png.header.message);
  return image;
}

void write_png(const std::string& path, const Image& image) {
  PngImage png;
  const int channels = image.dim(2).extent();
  if (image.type().bits != 8 || channels > 4) refuse(path, "holds 1 to 4 channels of 8 bits");
  std::ostringstream samples;
  write_samples<uint8_t>(image, channels, samples);
  const std::string bytes = samples.str();
  png.header.width = static_cast<png_uint_32>(image.dim(0).extent());
  png.header.height = static_cast<png_uint_32>(image.dim(1).extent());
  png.header.format = png_format(channels);
  if (!png_image_write_to_file(&png.header, path.c_str(), 0, bytes.data(), 0, nullptr))
    refuse(path, std::string("cannot be written: ") + png.header.message);
}
#endif

#ifdef RETROGRADE_RUN_GEN_JPEG
void write_as_jpeg(const std::string& path, const Image& image) {
  const int channels = image.dim(2).extent();
  if (channels != 1 && channels != 3) refuse(path, "holds 1 or 3 channels of 8 bits");
  std::ostringstream samples;
  write_samples<uint8_t>(image, channels, samples);
  write_jpeg(path, image.dim(0).extent(), image.dim(1).extent(), channels, samples.str());
}
#endif

// ---- types and dimensions ----

// Converts as fractions of the type's largest value; floats already hold the fraction.
template <typename To, typename From>
To rescaled(From value) {
  double fraction = static_cast<double>(value);
  if constexpr (!std::is_floating_point_v<From>)
    fraction /= static_cast<double>(std::numeric_limits<From>::max());
  if constexpr (std::is_floating_point_v<To>) return static_cast<To>(fraction);
  const double largest = static_cast<double>(std::numeric_limits<To>::max());
  const double scaled = std::nearbyint(fraction * largest);
  if (!(scaled > 0)) return To(0);  // NaN too
  return scaled < largest ? static_cast<To>(scaled) : std::numeric_limits<To>::max();
}

template <typename To, typename From>
To converted(From value, bool is_picture) {
  return is_picture ? rescaled<To>(value) : static_cast<To>(value);
}

Image converted(const Image& image, halide_type_t type, bool is_picture) {
  if (image.type() == type) return image;
  Image result(type, nullptr, image.dimensions(), image.raw_buffer()->dim);
  result.allocate();
  with_type(image.type(), [&](auto from) {
    with_type(type, [&](auto to) {
      using From = decltype(from);
      using To = decltype(to);
      result.as<To>().for_each_value(
          [&](To& out, const From& in) { out = converted<To>(in, is_picture); },
          image.as<const From>());
    });
  });
  return result;
}

// Adds or removes trailing dimensions of extent 1.
Image with_dimensions(const std::string& path, Image image, int dimensions) {
  while (image.dimensions() > dimensions) {
    const int last = image.dimensions() - 1;
    if (image.dim(last).extent() != 1) {
      refuse(path, "has " + std::to_string(image.dimensions()) + " dimensions; " +
                       std::to_string(dimensions) + " are wanted");
    }
    image = image.sliced(last, image.dim(last).min());
  }
  while (image.dimensions() < dimensions) image.add_dimension();
  return image;
}

bool is_jpeg(const std::string& kind) { return kind == "jpg" || kind == "jpeg"; }

bool is_picture(const std::string& path) {
  const std::string kind = extension(path);
  return kind == "pgm" || kind == "ppm" || kind == "png" || is_jpeg(kind);
}

[[noreturn]] void refuse_kind(const std::string& path) {
  refuse(path, "has an unknown format; known formats are .npy, .tmp, .pgm, .ppm, .png and .jpg");
}

}  // namespace

Image read_image(const std::string& path, halide_type_t type, int dimensions) {
  const std::string kind = extension(path);
  Image image;
  if (kind == "tmp")
    image = read_tmp(path);
  else if (kind == "npy")
    image = read_npy(path);
  else if (kind == "pgm" || kind == "ppm")
    image = read_pnm(path);
#ifdef RETROGRADE_RUN_GEN_PNG
  else if (kind == "png")
    image = read_png(path);
#endif
#ifdef RETROGRADE_RUN_GEN_JPEG
  else if (is_jpeg(kind))
    image = read_jpeg(path);
#endif
  else
    refuse_kind(path);
  return with_dimensions(path, converted(image, type, is_picture(path)), dimensions);
}

void write_image(const std::string& path, const Image& image) {
  const std::string kind = extension(path);
  if (kind == "npy" || kind == "tmp") {
    if (retrograde_debug_to_file(nullptr, path.c_str(), image.raw_buffer()) != 0)
      refuse(path, "cannot be written");
    return;
  }
  if (!is_picture(path)) refuse_kind(path);
  const bool is_wide = image.type().bits == 16 && kind != "png" && !is_jpeg(kind);
  const Image picture = with_dimensions(
      path, converted(image, {halide_type_uint, uint8_t(is_wide ? 16 : 8)}, true), 3);
#ifdef RETROGRADE_RUN_GEN_PNG
  if (kind == "png") return write_png(path, picture);
#endif
#ifdef RETROGRADE_RUN_GEN_JPEG
  if (is_jpeg(kind)) return write_as_jpeg(path, picture);
#endif
  if (kind == "png" || is_jpeg(kind)) refuse_kind(path);
  write_pnm(path, picture);
}

}  // namespace retrograde::run_gen
