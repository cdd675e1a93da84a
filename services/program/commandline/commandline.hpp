#pragma once
// Flags and subcommands of the programs. This header hides CLI11, which costs every file that includes it
// seconds of compiling; only commandline.cpp does.

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace tandem::commandline {

/// One flag or argument of a command, which owns it. All members return the same option, so that calls can be
/// chained.
class Option {
 public:
  explicit Option(CLI::Option& option) : option_(&option) {}

  /// Sets what values are allowed; another value is wrong usage. `range` takes int, unsigned, std::size_t and
  /// double, and --help names the type.
  template <class T>
  Option range(T least, T most);
  Option positive();
  Option not_negative();
  Option existing_file();
  /// For what protects something: an empty value, as of a variable that nobody set, is not taken for none.
  Option not_empty();
  Option one_of(const std::vector<std::string>& names);
  /// `refusal` returns an empty text for a good value, else what was expected.
  Option check(const std::function<std::string(const std::string& value)>& refusal);

  Option required(bool is = true);
  Option needs(Option other);
  Option excludes(Option other);
  /// Excludes other options of the same command, by name. A name that does not exist is an error of the
  /// program.
  Option excludes(const std::vector<std::string>& others);

  Option separated_by(char delimiter);  ///< several values in one text
  Option one_value_each();              ///< for a list: each flag takes one value and may be repeated
  Option type_name(const std::string& name);
  Option show_default();  ///< --help shows the current value of the variable
  Option show_default(const std::string& text);

 private:
  CLI::Option* option_;
};

/// A program's command line, or one of its subcommands. A name with dashes is a flag, one without is an
/// argument. Variables outlive the parsing.
class Command {
 public:
  explicit Command(CLI::App& app) : app_(&app) {}

  /// T: an integer of 16 to 64 bits without sign, int, double, std::string, std::optional of a number, or a
  /// vector of texts or of 32-bit numbers; commandline.cpp lists them.
  template <class T>
  Option add_option(const std::string& name, T& variable, const std::string& help = {});
  /// Calls `set` with the value. T: one of the types that commandline.cpp lists.
  template <class T>
  Option add_option_function(const std::string& name, const std::function<void(const T& value)>& set,
                             const std::string& help);
  /// One of several names, each with its value.
  template <class T>
  Option add_choice(const std::string& name, T& variable, const std::map<std::string, T>& values,
                    const std::string& help) {
    std::vector<std::string> names;
    names.reserve(values.size());
    for (const auto& [text, value] : values) names.push_back(text);
    const auto set = [&variable, values](const std::string& text) { variable = values.at(text); };
    return add_option_function<std::string>(name, set, help).one_of(names);
  }
  Option add_flag(const std::string& name, bool& variable, const std::string& help = {});
  Option add_flag_function(const std::string& name, const std::function<void()>& set,
                           const std::string& help);
  [[nodiscard]] Option option(const std::string& name) const;

  Command add_subcommand(const std::string& name, const std::string& help);
  [[nodiscard]] bool has_subcommand(const std::string& name) const;
  void require_subcommand();
  void footer(const std::string& text);
  /// Called when the command line has chosen this command and all its values are set. May refuse(), as below.
  void on_chosen(const std::function<void()>& callback);

 private:
  CLI::App* app_;
};

/// The whole command line of a program.
class Program : public Command {
 public:
  explicit Program(const std::string& description, const std::string& name = {});
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  /// Sets what --version prints.
  void version(const std::string& text);
  /// Prints help, version and errors. Returns an exit code if the program has to end: 0, or 2 for wrong
  /// usage, which `why` then holds.
  [[nodiscard]] std::optional<int> parse(int argc, const char* const* argv, std::string* why = nullptr);

 private:
  explicit Program(std::unique_ptr<CLI::App> app);

  std::unique_ptr<CLI::App> app_;
};

/// Reports wrong usage from a callback: "FLAG: EXPECTED", "FLAG is required", "FLAG requires OTHER".
[[noreturn]] void refuse(const std::string& flag, const std::string& expected);
[[noreturn]] void refuse_missing(const std::string& flag);
[[noreturn]] void refuse_without(const std::string& flag, const std::string& other);

}  // namespace tandem::commandline
