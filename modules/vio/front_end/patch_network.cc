#include "vio/front_end/patch_network.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

namespace pangea::vio {
namespace {

// The weights file, little-endian: magic, version, channels of the three convolutions; for each of
// them scales, offsets, weights; the linear layer's thresholds and weights; the checksum.
constexpr std::array<uint8_t, 4> kMagic = {'P', 'G', 'D', 'W'};
constexpr uint32_t kVersion = 1;
constexpr int kTaps = 9;
constexpr int kChannelsStep = 8;  // PackedWeights
constexpr int kMaxChannels = 256;
// Normalised grey values are clamped to this many standard deviations, which become 127.
constexpr float kMaxDeviations = 4.F;
constexpr float kMinDeviation = 2.F;  // grey levels, added: noise is not stretched over the range

#include "patch_network_weights.inc"

// FNV-1a (Fowler, Noll, Vo), 32 bits.
uint32_t Checksum(std::span<const uint8_t> bytes) {
  uint32_t hash = 2166136261U;
  for (const uint8_t byte : bytes) {
    hash = (hash ^ byte) * 16777619U;
  }
  return hash;
}

class WeightsReader {
 public:
  WeightsReader(std::span<const uint8_t> bytes, std::string file)
      : left_(bytes), file_(std::move(file)) {}

  template <typename T>
  T Get(const char* field) {
    T value;
    std::memcpy(&value, Take(sizeof(T), field).data(), sizeof(T));
    return value;
  }
  template <typename T>
  std::vector<T> GetMany(size_t count, const char* field) {
    std::vector<T> values(count);
    std::memcpy(values.data(), Take(count * sizeof(T), field).data(), count * sizeof(T));
    return values;
  }
  PackedWeights GetWeights(int outputs, int length, const char* field) {
    return {GetMany<int8_t>(static_cast<size_t>(outputs) * length, field), outputs, length};
  }
  size_t left() const { return left_.size(); }

  [[noreturn]] void Refuse(const std::string& what) const {
    throw std::runtime_error(fmt::format(
        "{}: {}; make the file anew with modules/vio/descriptor_training/train", file_, what));
  }

 private:
  std::span<const uint8_t> Take(size_t count, const char* field) {
    if (left_.size() < count) {
      Refuse(fmt::format("it ends within the field '{}'", field));
    }
    const auto taken = left_.first(count);
    left_ = left_.subspan(count);
    return taken;
  }

  std::span<const uint8_t> left_;
  std::string file_;
};

// Normalised grey values, 127 for kMaxDeviations.
std::vector<int16_t> Normalised(const PatchNetwork::Patch& patch) {
  int32_t sum = 0, squares = 0;
  for (const uint8_t grey : patch) {
    sum += grey;
    squares += grey * grey;
  }
  constexpr float kCount = PatchNetwork::kPatchPixels;
  const float mean = static_cast<float>(sum) / kCount;
  const float variance = static_cast<float>(squares) / kCount - mean * mean;
  const float scale = 127.F / kMaxDeviations / (std::sqrt(std::max(variance, 0.F)) + kMinDeviation);
  std::vector<int16_t> out(patch.size());
  for (size_t i = 0; i < patch.size(); ++i) {
    const float value = (static_cast<float>(patch[i]) - mean) * scale;
    out[i] = static_cast<int16_t>(std::lrint(std::clamp(value, -127.F, 127.F)));
  }
  return out;
}

// The 3x3 neighbourhood of an output pixel, with zeros outside: above and left of the image.
void Gather(const std::vector<int16_t>& in, int side, int channels, int row, int column,
            int16_t* out) {
  const int first = column == 0 ? 0 : -1;
  for (int dy = -1; dy <= 1; ++dy, out += 3 * channels) {
    if (2 * row + dy < 0) {
      std::fill_n(out, 3 * channels, int16_t{0});
      continue;
    }
    std::fill_n(out, channels, int16_t{0});
    const std::ptrdiff_t at =
        std::ptrdiff_t{2} * column + first + std::ptrdiff_t{side} * (2 * row + dy);
    std::copy_n(in.data() + at * channels, (2 - first) * channels, out + (first + 1) * channels);
  }
}

}  // namespace

const PatchNetwork& PatchNetwork::BuiltIn() {
  static const PatchNetwork kNetwork(kWeights, "patch_network.weights");
  return kNetwork;
}

PatchNetwork::PatchNetwork(std::span<const uint8_t> bytes, const std::string& file) {
  WeightsReader reader(bytes, file);
  if (reader.GetMany<uint8_t>(kMagic.size(), "magic") !=
      std::vector<uint8_t>(kMagic.begin(), kMagic.end())) {
    reader.Refuse("field 'magic': these are not weights of a descriptor");
  }
  if (const auto version = reader.Get<uint32_t>("version"); version != kVersion) {
    reader.Refuse(
        fmt::format("field 'version' is {}, and this program reads {}", version, kVersion));
  }
  if (uint32_t sum = 0; bytes.size() >= sizeof(sum)) {
    std::memcpy(&sum, bytes.last(sizeof(sum)).data(), sizeof(sum));
    if (sum != Checksum(bytes.first(bytes.size() - sizeof(sum)))) {
      reader.Refuse("field 'checksum': the file is damaged");
    }
  }
  int side = kPatchSide, channels = 1;
  for (Convolution& convolution : convolutions_) {
    const auto out = reader.Get<uint32_t>("channels");
    if (out == 0 || out > kMaxChannels || out % kChannelsStep != 0) {
      reader.Refuse(fmt::format("field 'channels' is {}, and must be a multiple of {} up to {}",
                                out, kChannelsStep, kMaxChannels));
    }
    convolution.in_side = side;
    convolution.in_channels = channels;
    convolution.scales.resize(out);
    side /= 2;
    channels = static_cast<int>(out);
  }
  for (Convolution& convolution : convolutions_) {
    const auto outputs = static_cast<int>(convolution.scales.size());
    convolution.scales = reader.GetMany<float>(outputs, "scales");
    convolution.offsets = reader.GetMany<float>(outputs, "offsets");
    convolution.weights = reader.GetWeights(outputs, kTaps * convolution.in_channels, "weights");
  }
  for (int32_t& threshold : thresholds_) {
    threshold = reader.Get<int32_t>("thresholds");
  }
  linear_ = reader.GetWeights(kDescriptorBits, side * side * channels, "linear weights");
  if (reader.left() != sizeof(uint32_t)) {
    reader.Refuse(fmt::format("{} bytes follow the last field", reader.left()));
  }
}

void PatchNetwork::Convolution::Apply(const std::vector<int16_t>& in,
                                      std::vector<int16_t>* out) const {
  constexpr int kInputs = PackedWeights::kInputs;
  const int outputs = weights.outputs();
  const int pixels = out_side() * out_side();
  std::vector<int16_t> neighbourhoods(static_cast<size_t>(kInputs) * weights.padded_length(), 0);
  std::array<int32_t, static_cast<size_t>(kInputs) * kMaxChannels> sums;
  out->resize(static_cast<size_t>(pixels) * outputs);
  for (int pixel = 0; pixel < pixels; pixel += kInputs) {
    for (int i = 0; i < kInputs; ++i) {
      Gather(in, in_side, in_channels, (pixel + i) / out_side(), (pixel + i) % out_side(),
             neighbourhoods.data() + static_cast<std::ptrdiff_t>(i) * weights.padded_length());
    }
    weights.MultiplyFour(neighbourhoods.data(), sums.data());
    for (int i = 0; i < kInputs; ++i) {
      Requantise(sums.data() + static_cast<std::ptrdiff_t>(i) * outputs, scales.data(),
                 offsets.data(), outputs,
                 out->data() + static_cast<std::ptrdiff_t>(pixel + i) * outputs);
    }
  }
}

std::vector<Descriptor> PatchNetwork::Describe(std::span<const Patch> patches) const {
  constexpr size_t kInputs = PackedWeights::kInputs;
  std::vector<Descriptor> descriptors(patches.size());
  std::vector<int16_t> features(kInputs * linear_.padded_length(), 0);
  std::vector<int32_t> outputs(kInputs * kDescriptorBits);
  for (size_t begin = 0; begin < patches.size(); begin += kInputs) {
    const size_t count = std::min(kInputs, patches.size() - begin);
    for (size_t i = 0; i < count; ++i) {
      std::vector<int16_t> in = Normalised(patches[begin + i]), out;
      for (const Convolution& convolution : convolutions_) {
        convolution.Apply(in, &out);
        in.swap(out);
      }
      std::copy(in.begin(), in.end(),
                features.begin() + static_cast<std::ptrdiff_t>(i) * linear_.padded_length());
    }
    linear_.MultiplyFour(features.data(), outputs.data());
    for (size_t i = 0; i < count * kDescriptorBits; ++i) {
      const size_t bit = i % kDescriptorBits;
      descriptors[begin + i / kDescriptorBits][bit / 64] |= uint64_t{outputs[i] >= thresholds_[bit]}
                                                            << (bit % 64);
    }
  }
  return descriptors;
}

}  // namespace pangea::vio
