# shellcheck shell=bash
# Sourced by virtual-bench: the kernel, built once for a given source package and configuration.

# bench_kernel [systemd] : prints the path of the kernel, building it first where the cache has none.
bench_kernel() {
  local configs=("$root/tools/virtual-bench.d/kernel.config" ${1:+"$root/tools/virtual-bench.d/$1.config"})
  local cache=${XDG_CACHE_HOME:-$HOME/.cache}/sinerig/virtual-bench
  [ "$(uname -m)" = x86_64 ] || cannot "User-Mode-Linux is built for x86_64 only; this machine is $(uname -m)"
  mkdir -p "$cache" || cannot "$cache cannot be made; set XDG_CACHE_HOME to a folder that can"

  local key kernel
  key=$({ cat "${configs[@]}" | sed 's/#.*//' | sort; declare -f adapt_source read_the_clock_in_4_ns fire_simulated_interrupts_at_once tell_of_simulated_levels; } | sha256sum | cut -c 1-12)
  kernel=$cache/linux-$key
  if [ ! -x "$kernel" ]; then
    exec 9>"$cache/lock"
    flock 9
    [ -x "$kernel" ] || build_kernel "$cache" "$kernel" "${configs[@]}"
    exec 9>&-
  fi
  echo "$kernel"
}

adapt_source() {
  read_the_clock_in_4_ns && fire_simulated_interrupts_at_once && tell_of_simulated_levels
}

# In virtual time reading the clock costs time, so that a program which waits by reading it gets on:
# 256 ns, which is also the resolution. That much jitter in when commands take effect is noise in the
# 1e-6 of a response; 4 ns is not.
read_the_clock_in_4_ns() {
  sed -i 's/^#define TIMER_MULTIPLIER 256$/#define TIMER_MULTIPLIER 4/' arch/um/include/linux/time-internal.h
  grep -q '^#define TIMER_MULTIPLIER 4$' arch/um/include/linux/time-internal.h
}

# Simulated interrupts wait for the next 10 ms tick here, and those of one line that meet there become
# one. The edges of an encoder need theirs at once.
fire_simulated_interrupts_at_once() {
  local file=kernel/irq/irq_sim.c
  insert_before '^static void irq_sim_irqmask' $file <<'C'
static void irq_sim_handle_irq(struct irq_work *work);

static void irq_sim_fire(struct irq_sim_work_ctx *work_ctx)
{
	unsigned long flags;

	local_irq_save(flags);
	irq_sim_handle_irq(&work_ctx->work);
	local_irq_restore(flags);
}

C
  sed -i 's/irq_work_queue(&irq_ctx->work_ctx->work);/irq_sim_fire(irq_ctx->work_ctx);/' $file
  [ "$(grep -c 'irq_sim_fire(' $file)" = 2 ]
}

# Whoever polls the sysfs file of a level is woken when it is set, so that a simulated device sees each
# edge of an output when it happens.
tell_of_simulated_levels() {
  local file=drivers/gpio/gpio-sim.c one='\tgpio_sim_changed(chip, offset);'
  insert_before '^static int gpio_sim_apply_pull' $file <<'C'
static void gpio_sim_changed(struct gpio_sim_chip *chip, unsigned int offset)
{
	char name[24];

	snprintf(name, sizeof(name), "sim_gpio%u", offset);
	sysfs_notify(&chip->gc.gpiodev->dev.kobj, name, "value");
}

static void gpio_sim_all_changed(struct gpio_sim_chip *chip, unsigned long *mask)
{
	unsigned int offset;

	for_each_set_bit(offset, mask, chip->gc.ngpio)
		gpio_sim_changed(chip, offset);
}

C
  sed -i -e "/^static void gpio_sim_set(/,/^}/s/^}/$one\n}/" \
    -e "/^static void gpio_sim_free(/,/^}/s/^}/$one\n}/" \
    -e "/^static int gpio_sim_direction_output(/,/^}/s/^\treturn 0;/$one\n&/" \
    -e '/^static void gpio_sim_set_multiple(/,/^}/s/^}/\tgpio_sim_all_changed(chip, mask);\n}/' $file
  [ "$(grep -c '_changed(' $file)" = 7 ]
}

# insert_before PATTERN FILE : standard input, before the first line that matches.
insert_before() {
  local line
  line=$(grep -n -m 1 "$1" "$2" | cut -d : -f 1)
  [ -n "$line" ] && sed -i "$((line - 1))r /dev/stdin" "$2"
}

build_kernel() {
  local cache=$1 kernel=$2 archive work
  shift 2
  (need linux-source flex bison bc make gcc libc6-dev xz-utils) >&2 ||
    cannot "the packages that the kernel is built from and with could not be installed"
  archive=$(find /usr/src -maxdepth 1 -name 'linux-source-*.tar.xz' | sort -V | tail -n 1)
  [ -n "$archive" ] || cannot "/usr/src has no linux-source-*.tar.xz although linux-source is installed"

  work=$(mktemp -d "$cache/build.XXXXXX")
  echo "virtual-bench: building the kernel of $archive once, about 5 minutes; log in $cache/build.log" >&2
  if ! (
    tar -xf "$archive" -C "$work" --strip-components=1 &&
      cd "$work" &&
      adapt_source &&
      cat "$@" >all.config &&
      make ARCH=um SUBARCH=x86_64 KCONFIG_ALLCONFIG=all.config allnoconfig &&
      nice -n 10 make ARCH=um SUBARCH=x86_64 -j "$(nproc)" linux &&
      strip -o "$kernel.new" linux
  ) >"$cache/build.log" 2>&1; then
    tail -n 20 "$cache/build.log" >&2
    rm -rf "$work"
    cannot "the kernel did not build; the end of $cache/build.log is above"
  fi
  rm -rf "$work"
  mv "$kernel.new" "$kernel"
}
