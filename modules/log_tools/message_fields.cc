#include "log_tools/message_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cstdint>
#include <map>
#include <stdexcept>

#include "core/big_endian.h"
#include "pangea_schemas.h"

namespace pangea {
namespace {

struct Member {
  std::string type;
  std::string name;
  std::vector<std::string> dimensions;  // numbers, or names of earlier members
};

struct Type {
  std::string name;
  std::vector<Member> members;
};

// Splits a type's text into words and punctuation, without comments.
std::vector<std::string> Tokens(const std::string& text) {
  std::vector<std::string> tokens;
  for (size_t i = 0; i < text.size();) {
    const auto is_word = [&text](size_t at) {
      return at < text.size() &&
             (std::isalnum(static_cast<unsigned char>(text[at])) != 0 || text[at] == '_');
    };
    if (text.compare(i, 2, "//") == 0) {
      i = std::min(text.find('\n', i), text.size());
    } else if (is_word(i)) {
      const size_t begin = i;
      while (is_word(i)) {
        ++i;
      }
      tokens.push_back(text.substr(begin, i - begin));
    } else {
      if (std::isspace(static_cast<unsigned char>(text[i])) == 0) {
        tokens.emplace_back(1, text[i]);
      }
      ++i;
    }
  }
  return tokens;
}

// Parses a text that lcm-gen has accepted: package p; struct t { type name[n]; const ...; }
Type ParseType(const std::string& text) {
  const std::vector<std::string> tokens = Tokens(text);
  Type type;
  size_t i = 0;
  while (tokens.at(i) != "struct") {
    ++i;
  }
  type.name = tokens.at(i + 1);
  for (i += 3; tokens.at(i) != "}"; ++i) {  // skips "{", and then each ";"
    if (tokens.at(i) == "const") {
      while (tokens.at(i) != ";") {
        ++i;
      }
      continue;
    }
    Member member{tokens.at(i), tokens.at(i + 1), {}};
    for (i += 2; tokens.at(i) == "["; i += 3) {
      member.dimensions.push_back(tokens.at(i + 1));
    }
    if (tokens.at(i) != ";") {
      throw std::logic_error(fmt::format("{}.{}: not as we write types", type.name, member.name));
    }
    type.members.push_back(std::move(member));
  }
  return type;
}

struct Types {
  std::map<std::string, Type> by_name;
  std::map<int64_t, std::string> by_fingerprint;

  Types() {
    for (const LcmSchema& schema : LcmSchemas()) {
      Type type = ParseType(schema.text);
      by_fingerprint.emplace(schema.fingerprint, type.name);
      std::string name = type.name;
      by_name.emplace(std::move(name), std::move(type));
    }
  }
  static const Types& Ours() {
    static const Types types;
    return types;
  }
};

// Reads big-endian values, as LCM encodes them. Past the end it returns zeros and sets a flag.
class Reader {
 public:
  explicit Reader(Bytes data) : data_(data) {}

  bool good() const { return good_; }
  bool AtEnd() const { return good_ && at_ == data_.size(); }
  size_t left() const { return data_.size() - at_; }

  uint64_t Unsigned(size_t bytes) {
    if (left() < bytes) {
      good_ = false;
      at_ = data_.size();
      return 0;
    }
    at_ += bytes;
    return GetBigEndian(data_.data() + at_ - bytes, bytes);
  }
  void Fail() { good_ = false; }
  // A string is its length, its characters, and a zero.
  std::string String() {
    const uint64_t length = Unsigned(4);
    if (length < 1 || length > left()) {
      good_ = false;
      return {};
    }
    std::string text(reinterpret_cast<const char*>(data_.data()) + at_, length - 1);
    at_ += length;
    return text;
  }

 private:
  Bytes data_;
  size_t at_ = 0;
  bool good_ = true;
};

class Decoder {
 public:
  Decoder(Bytes data, std::vector<MessageField>* fields) : reader_(data), fields_(fields) {}

  bool Decode(const Type& type) {
    reader_.Unsigned(8);  // skip the fingerprint
    Struct(type, "");
    return reader_.AtEnd();
  }

 private:
  void Struct(const Type& type, const std::string& prefix) {
    std::map<std::string, int64_t> lengths;  // integer members so far, which may be dimensions
    for (const Member& member : type.members) {
      std::vector<int64_t> sizes;
      for (const std::string& dimension : member.dimensions) {
        const auto length = lengths.find(dimension);
        sizes.push_back(length != lengths.end() ? length->second : std::stoll(dimension));
      }
      if (const auto value = Array(member.type, prefix + member.name, sizes)) {
        lengths[member.name] = *value;
      }
    }
  }

  // Returns the value of a single integer; empty for others.
  std::optional<int64_t> Array(const std::string& type, const std::string& path,
                               const std::vector<int64_t>& sizes, size_t depth = 0) {
    if (depth == sizes.size()) {
      return Value(type, path);
    }
    if (sizes[depth] < 0) {
      reader_.Fail();
    }
    for (int64_t i = 0; i < sizes[depth] && reader_.good(); ++i) {
      Array(type, fmt::format("{}[{}]", path, i), sizes, depth + 1);
    }
    return std::nullopt;
  }

  std::optional<int64_t> Value(const std::string& type, const std::string& path) {
    if (const auto nested = Types::Ours().by_name.find(type);
        nested != Types::Ours().by_name.end()) {
      Struct(nested->second, path + ".");
      return std::nullopt;
    }
    if (type == "string") {
      const nlohmann::json text = reader_.String();
      fields_->push_back(
          {path, text.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)});
    } else if (type == "double") {
      fields_->push_back({path, fmt::format("{}", std::bit_cast<double>(reader_.Unsigned(8)))});
    } else if (type == "float") {
      const auto bits = static_cast<uint32_t>(reader_.Unsigned(4));
      fields_->push_back({path, fmt::format("{}", std::bit_cast<float>(bits))});
    } else if (type == "boolean") {
      fields_->push_back({path, reader_.Unsigned(1) != 0 ? "true" : "false"});
    } else {
      const int64_t value = Integer(type);
      fields_->push_back({path, fmt::format("{}", value)});
      return value;
    }
    return std::nullopt;
  }

  int64_t Integer(const std::string& type) {
    if (type == "byte") {
      return static_cast<int64_t>(reader_.Unsigned(1));
    }
    if (type == "int8_t") {
      return static_cast<int8_t>(reader_.Unsigned(1));
    }
    if (type == "int16_t") {
      return static_cast<int16_t>(reader_.Unsigned(2));
    }
    if (type == "int32_t") {
      return static_cast<int32_t>(reader_.Unsigned(4));
    }
    if (type == "int64_t") {
      return static_cast<int64_t>(reader_.Unsigned(8));
    }
    throw std::logic_error(fmt::format("lcmtypes have no type {}", type));
  }

  Reader reader_;
  std::vector<MessageField>* fields_;
};

// Converts "candidates[0].score" to /candidates/0/score.
nlohmann::ordered_json::json_pointer Pointer(const std::string& path) {
  std::string pointer = "/";
  for (const char c : path) {
    if (c == '.' || c == '[') {
      pointer += '/';
    } else if (c != ']') {
      pointer += c;
    }
  }
  return nlohmann::ordered_json::json_pointer(pointer);
}

nlohmann::ordered_json Value(const std::string& text) {
  constexpr int64_t kExact = int64_t{1} << 53;
  const auto value = nlohmann::ordered_json::parse(text, nullptr, false);
  if (value.is_discarded()) {
    return nullptr;  // nan, inf
  }
  const bool rounded = value.is_number_integer() &&
                       (value.get<int64_t>() > kExact || value.get<int64_t>() < -kExact);
  return rounded ? nlohmann::ordered_json(text) : value;
}

}  // namespace

nlohmann::ordered_json ToJson(const DecodedMessage& message) {
  auto json = nlohmann::ordered_json::object();
  for (const MessageField& field : message.fields) {
    json[Pointer(field.path)] = Value(field.value);
  }
  return json;
}

std::optional<std::string> TypeOf(Bytes data) {
  const auto fingerprint = static_cast<int64_t>(Reader(data).Unsigned(8));
  const auto type = Types::Ours().by_fingerprint.find(fingerprint);
  return type == Types::Ours().by_fingerprint.end() ? std::nullopt : std::optional(type->second);
}

std::optional<DecodedMessage> DecodeFields(Bytes data) {
  const auto type = TypeOf(data);
  if (!type) {
    return std::nullopt;
  }
  DecodedMessage message{*type, {}};
  const bool fits = Decoder(data, &message.fields).Decode(Types::Ours().by_name.at(*type));
  return fits ? std::optional(std::move(message)) : std::nullopt;
}

}  // namespace pangea
