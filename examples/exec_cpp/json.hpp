// A reader of JSON, as small as will do: one value from one line of text.
#pragma once

#include <cctype>
#include <cstdlib>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace json {

// A value: of its members only those of its own kind are filled. null is none of them.
struct Value {
  bool boolean = false;
  double number = 0.0;
  std::string text;
  std::vector<Value> items;
  std::map<std::string, Value> members;

  const Value& operator[](const std::string& name) const {
    const auto found = members.find(name);
    if (found == members.end()) throw std::runtime_error("no member " + name);
    return found->second;
  }
  const Value& operator[](size_t index) const { return items.at(index); }
  size_t size() const { return items.size(); }
};

class Reader {
 public:
  explicit Reader(const std::string& text) : text_(text) {}

  Value read() {
    const Value value = any();
    if (next() != '\0') fail("the end");
    return value;
  }

 private:
  char next() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])))
      ++at_;
    return at_ < text_.size() ? text_[at_] : '\0';
  }

  [[noreturn]] void fail(const std::string& expected) const {
    throw std::runtime_error("expected " + expected + " at character " +
                             std::to_string(at_));
  }

  void take(char wanted) {
    if (next() != wanted) fail(std::string(1, wanted));
    ++at_;
  }

  bool word(const std::string& wanted) {
    if (text_.compare(at_, wanted.size(), wanted) != 0) return false;
    at_ += wanted.size();
    return true;
  }

  Value any() {
    Value value;
    switch (next()) {
      case '{': object(value); break;
      case '[': array(value); break;
      case '"': value.text = string(); break;
      default: plain(value);
    }
    return value;
  }

  void object(Value& value) {
    take('{');
    while (next() != '}') {
      const std::string name = string();
      take(':');
      value.members[name] = any();
      if (next() != '}') take(',');
    }
    take('}');
  }

  void array(Value& value) {
    take('[');
    while (next() != ']') {
      value.items.push_back(any());
      if (next() != ']') take(',');
    }
    take(']');
  }

  // Names and kinds are ASCII; other characters come as they are, \u escapes as '?'.
  std::string string() {
    take('"');
    std::string found;
    while (at_ < text_.size() && text_[at_] != '"') {
      char letter = text_[at_++];
      if (letter == '\\' && at_ < text_.size()) {
        letter = text_[at_++];
        if (letter == 'n') letter = '\n';
        if (letter == 't') letter = '\t';
        if (letter == 'u') at_ += 4, letter = '?';
      }
      found += letter;
    }
    take('"');
    return found;
  }

  void plain(Value& value) {
    if (word("null") || word("false")) return;
    if (word("true")) {
      value.boolean = true;
      return;
    }
    char* end = nullptr;
    const char* begin = text_.c_str() + at_;
    value.number = std::strtod(begin, &end);
    if (end == begin) fail("a value");
    at_ += static_cast<size_t>(end - begin);
  }

  const std::string& text_;
  size_t at_ = 0;
};

}  // namespace json
