// Helpers of all pipelines of the differential tests. Included inside a namespace of its own, in
// which the language (Halide or Retrograde) is visible; this file names neither.

// A pipeline: its outputs, and the box over which each is realized.
struct Built {
  std::vector<Func> outputs;
  std::vector<std::vector<int>> extents;
  std::vector<std::vector<int>> mins;  // empty: zeros
};

struct Case {
  std::string name;
  Built (*build)(bool scheduled);
};

inline std::vector<Case>& cases() {
  static std::vector<Case> all;
  return all;
}

struct Registered {
  Registered(const char* name, Built (*build)(bool)) { cases().push_back({name, build}); }
};

// PIPELINE(name) { ... return Built{...}; }   `scheduled`: also apply the schedule.
#define PIPELINE(name)                                    \
  static Built name(bool scheduled);                      \
  static const Registered registered_##name(#name, name); \
  static Built name([[maybe_unused]] bool scheduled)

inline uint32_t hash_of(uint32_t a, uint32_t b, uint32_t c, uint32_t seed) {
  uint32_t h = seed * 0x9e3779b9u + 0x85ebca6bu;
  for (uint32_t word : {a, b, c}) {
    h = (h ^ word) * 0xcc9e2d51u;
    h ^= h >> 15;
  }
  h *= 0x2c1b3c6du;
  return h ^ (h >> 13);
}

// Random values of a type: all values of narrow integers, small values of wide integers (signed
// overflow is undefined), floats between -4 and 4.
template <typename T>
T noise_value(uint32_t h) {
  if constexpr (std::is_same_v<T, bool>) {
    return (h & 1) != 0;
  } else if constexpr (!std::is_integral_v<T>) {
    return static_cast<T>(static_cast<float>(static_cast<int>(h >> 8) - (1 << 23)) / (1 << 21));
  } else if constexpr (sizeof(T) < 4) {
    return static_cast<T>(h);
  } else {
    return static_cast<T>(static_cast<T>(h % 60000u) - (std::is_signed_v<T> ? 30000 : 0));
  }
}

// Random values, mixed with the extreme values of the type and values near zero.
template <typename T>
T edgy_value(uint32_t h) {
  if constexpr (std::is_integral_v<T> && sizeof(T) < 4 && !std::is_same_v<T, bool>) {
    const T edges[] = {std::numeric_limits<T>::min(),
                       std::numeric_limits<T>::max(),
                       T(0),
                       T(1),
                       T(-1),
                       T(2),
                       T(-3),
                       T(7)};
    if (h & 1) return edges[(h >> 1) & 7];
  } else if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool>) {
    const T edges[] = {T(0),
                       T(1),
                       T(2),
                       std::is_signed_v<T> ? T(-1) : T(3),
                       std::is_signed_v<T> ? T(-7) : T(7),
                       T(10),
                       T(255),
                       T(256)};
    if (h & 1) return edges[(h >> 1) & 7];
  }
  return noise_value<T>(h >> 4);
}

template <typename T>
Buffer<T> noise(std::vector<int> extents, uint32_t seed = 1,
                T (*value)(uint32_t) = noise_value<T>) {
  Buffer<T> image(extents);
  const int w = extents[0];
  const int h = extents.size() > 1 ? extents[1] : 1;
  const int c = extents.size() > 2 ? extents[2] : 1;
  for (int k = 0; k < c; ++k) {
    for (int j = 0; j < h; ++j) {
      for (int i = 0; i < w; ++i) {
        const T v = value(hash_of(i, j, k, seed));
        if (extents.size() == 1) {
          image(i) = v;
        } else if (extents.size() == 2) {
          image(i, j) = v;
        } else {
          image(i, j, k) = v;
        }
      }
    }
  }
  return image;
}

template <typename T>
Buffer<T> edges(std::vector<int> extents, uint32_t seed) {
  return noise<T>(extents, seed, edgy_value<T>);
}

static const Var x("x"), y("y"), c("c"), xo("xo"), yo("yo"), xi("xi"), yi("yi"), t("t");
