//! A session: workers that inspect inputs, runs of accepted decks, and the files of faults.

use super::Options;
use super::generate::Corpus;
use super::input::{Input, Language};
use super::inspect::{Verdict, inspect, keep_panics};
use super::process::{self, PATIENCE};
use super::program::{Trial, try_deck};
use super::random::Random;
use std::collections::BTreeMap;
use std::fs;
use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, ExitCode, Stdio};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Decks with more elements are read and checked, but not run.
const MOST_ELEMENTS_OF_RUN: usize = 2_000;

/// Time to make a failing input smaller.
const TIME_TO_MINIMISE: Duration = Duration::from_secs(20);

/// Faults after which a worker is not started again.
const MOST_FAULTS: usize = 200;

/// Inspects inputs and prints a line for each: its number, then the verdict.
pub fn work(root: &Path, seed: u64, numbers: impl Iterator<Item = u64>) {
    let corpus = Corpus::new(root);
    keep_panics();
    for number in numbers {
        match inspect(&corpus.input(seed, number), &corpus) {
            Verdict::Refused => println!("{number} refused"),
            Verdict::Accepted(elements) => println!("{number} accepted {elements}"),
            Verdict::Large => println!("{number} large"),
            Verdict::Fault(fault) => println!("{number} fault {fault:?}"),
        }
    }
}

/// Inspects files; prints the first fault.
pub fn inspect_files(root: &Path, paths: &[PathBuf]) -> ExitCode {
    let corpus = Corpus::new(root);
    keep_panics();
    for input in paths.iter().flat_map(|path| Input::read(path)) {
        if let Verdict::Fault(fault) = inspect(&input, &corpus) {
            println!("{fault}");
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}

/// Times without an answer after which a worker hangs even if it does nothing.
const MOST_SILENT_TIMES: usize = 12;

/// A worker that has not answered for a while: it hangs, or other work has the processors.
#[derive(Default)]
struct Silence {
    /// Number of times [`PATIENCE`] without an answer
    times: usize,
    /// Processor time of the worker at the last of them, in seconds
    processor: Option<f64>,
}

impl Silence {
    /// True if the worker may have had no processor since it was asked last; called after each
    /// [`PATIENCE`] without an answer.
    fn is_idle(&mut self, worker: &Child) -> bool {
        let Some(now) = process::processor_seconds(worker) else { return false };
        let is_busy = self.processor.is_some_and(|before| now - before > 0.5 * PATIENCE.as_secs_f64());
        self.times += 1;
        self.processor = Some(now);
        !is_busy && self.times < MOST_SILENT_TIMES
    }
}

/// Counts of a session.
#[derive(Default)]
struct Tally {
    refused: usize,
    /// Accepted decks that are small enough to run, by number
    accepted: Vec<u64>,
    accepted_others: usize,
    large: usize,
    faults: Vec<Fault>,
}

/// A fault that was found.
struct Fault {
    name: String,
    symptom: String,
    input: Input,
}

/// A session of the fuzzer.
pub struct Session {
    options: Options,
    corpus: Corpus,
    /// Stored inputs that failed once
    stored: PathBuf,
    /// Parts of the symptoms of faults that are known and not mended yet
    known: Vec<String>,
    folder: PathBuf,
}

impl Session {
    /// A session with the decks of the repository.
    pub fn new(root: &Path, options: Options) -> Self {
        let known = fs::read_to_string(root.join("tests/fuzz/known.txt")).unwrap_or_default();
        let known =
            known.lines().filter(|line| !line.is_empty() && !line.starts_with('#')).map(str::to_string).collect();
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fuzz");
        Self { options, corpus: Corpus::new(root), stored: root.join("tests/fuzz/corpus"), known, folder }
    }

    /// Inspects and runs the stored inputs, then new ones; prints a summary.
    pub fn run(&self) -> io::Result<ExitCode> {
        let begun = Instant::now();
        let mut faults = Vec::new();
        let stored = Input::paths(&self.stored);
        for path in &stored {
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let input = Input::read(path)?;
            faults.extend(self.judge(&input)?.map(|symptom| Fault { name, symptom, input }));
        }
        let mut tally = Tally::default();
        self.on_jobs(|job| self.inspect_part(job as u64))?.into_iter().for_each(|part| tally.add(part));
        let Tally { refused, accepted, accepted_others, large, faults: found } = tally;
        let Options { seed, inputs, runs, .. } = self.options;
        println!(
            "fuzz: seed {seed}, {inputs} inputs and {} stored ones: {refused} refused, {} accepted, {large} not built \
             (too many elements), {} faults; {:.1} s",
            stored.len(),
            accepted.len() + accepted_others,
            found.len(),
            begun.elapsed().as_secs_f64()
        );
        faults.extend(found);
        let begun = Instant::now();
        let (counts, found) = self.run_decks(accepted, runs)?;
        let counts: Vec<String> = counts.iter().map(|(what, count)| format!("{count} {what}")).collect();
        println!("fuzz: accepted decks: {}; {:.1} s", counts.join(", "), begun.elapsed().as_secs_f64());
        faults.extend(found);
        Ok(self.report(faults))
    }

    /// Does work on threads; each gets its number.
    fn on_jobs<T: Send>(&self, work: impl Fn(usize) -> io::Result<T> + Sync) -> io::Result<Vec<T>> {
        let panicked = |_| Err(io::Error::other("a thread of the fuzzer panicked"));
        thread::scope(|scope| {
            let work = &work;
            let threads: Vec<_> = (0..self.options.jobs).map(|job| scope.spawn(move || work(job))).collect();
            threads.into_iter().map(|thread| thread.join().unwrap_or_else(panicked)).collect()
        })
    }

    /// Inspects every n-th input in a worker, which is started again behind an input that ends it.
    fn inspect_part(&self, job: u64) -> io::Result<Tally> {
        let mut tally = Tally::default();
        let mut next = job;
        while next < self.options.inputs && tally.faults.len() < MOST_FAULTS {
            let mut worker = self.worker(next)?;
            let lines = lines(&mut worker);
            let mut silence = Silence::default();
            let timed_out = loop {
                match lines.recv_timeout(PATIENCE) {
                    Ok(line) => {
                        self.take(&line, next, &mut tally);
                        next += self.options.jobs as u64;
                        silence = Silence::default();
                    }
                    Err(RecvTimeoutError::Timeout) if silence.is_idle(&worker) => {}
                    Err(RecvTimeoutError::Timeout) => break true,
                    Err(RecvTimeoutError::Disconnected) => break false,
                }
            };
            let _ = worker.kill();
            let ended = worker.wait()?;
            if next < self.options.inputs {
                let input = self.corpus.input(self.options.seed, next);
                let alone = self.judge_reading(&input, &self.folder.join(format!("alone{job}")))?;
                let end = if timed_out {
                    format!("hang: no answer within {PATIENCE:?}")
                } else {
                    format!("the worker ended: {ended}")
                };
                let symptom = alone.unwrap_or(format!("{end}; not if the input is read alone"));
                tally.faults.push(self.fault(next, symptom, input));
                next += self.options.jobs as u64;
            }
        }
        Ok(tally)
    }

    fn worker(&self, first: u64) -> io::Result<Child> {
        let mut command = process::limited(&std::env::current_exe()?);
        let Options { seed, inputs, jobs, .. } = self.options;
        let numbers = [("--seed", seed), ("--inputs", inputs), ("--from", first), ("--step", jobs as u64)];
        command.arg("--worker").args(numbers.iter().flat_map(|(name, number)| [name.to_string(), number.to_string()]));
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn()
    }

    fn take(&self, line: &str, number: u64, tally: &mut Tally) {
        let (own, verdict) = line.split_once(' ').unwrap_or_default();
        let input = || self.corpus.input(self.options.seed, number);
        let (word, rest) = verdict.split_once(' ').unwrap_or((verdict, ""));
        match (own == number.to_string(), word, rest.parse::<usize>()) {
            (true, "refused", _) => tally.refused += 1,
            (true, "large", _) => tally.large += 1,
            (true, "accepted", Ok(1..=MOST_ELEMENTS_OF_RUN)) => tally.accepted.push(number),
            (true, "accepted", Ok(0)) if input().language == Language::Deck => tally.accepted.push(number),
            (true, "accepted", _) => tally.accepted_others += 1,
            (true, "fault", _) => tally.faults.push(self.fault(number, rest.trim_matches('"').into(), input())),
            _ => tally.faults.push(self.fault(number, format!("a line on standard output: {line}"), input())),
        }
    }

    fn fault(&self, number: u64, symptom: String, input: Input) -> Fault {
        Fault { name: format!("{}-{number}", self.options.seed), symptom, input }
    }

    /// Checks and runs accepted decks until enough of them have been run.
    fn run_decks(&self, mut numbers: Vec<u64>, runs: usize) -> io::Result<(BTreeMap<&'static str, usize>, Vec<Fault>)> {
        let seed = self.options.seed;
        numbers.sort_by_key(|&number| Random::of(!seed, number).bits());
        let numbers = Mutex::new(numbers.into_iter());
        let counts = Mutex::new(BTreeMap::new());
        let faults = Mutex::new(Vec::new());
        let count = |what: &'static str| *lock(&counts).entry(what).or_insert(0_usize) += 1;
        let run_part = |job: usize| -> io::Result<()> {
            let folder = self.folder.join(format!("run{job}"));
            loop {
                let done = ["finished", "failed", "stopped by SIGTERM"]
                    .map(|what| lock(&counts).get(what).copied().unwrap_or(0));
                let Some(number) = (done.iter().sum::<usize>() < runs).then(|| lock(&numbers).next()).flatten() else {
                    return Ok(());
                };
                let input = self.corpus.input(seed, number);
                match try_deck(&input, &self.corpus, &folder)? {
                    Trial::Finished => count("finished"),
                    Trial::Failed => count("failed"),
                    Trial::Stopped => count("stopped by SIGTERM"),
                    Trial::Refused => count("refused by check"),
                    Trial::TooLong => count("skipped as too long"),
                    Trial::Fault(symptom) => {
                        count("with faults");
                        lock(&faults).push(self.fault(number, symptom, input));
                    }
                }
            }
        };
        self.on_jobs(run_part)?;
        let counts = lock(&counts).clone();
        Ok((counts, faults.into_inner().unwrap_or_else(PoisonError::into_inner)))
    }

    /// The fault of an input, if there is one: in reading it, or else in checking and running it.
    pub fn judge(&self, input: &Input) -> io::Result<Option<String>> {
        let folder = self.folder.join("judge");
        let reading = self.judge_reading(input, &folder)?;
        if reading.is_some() || input.language != Language::Deck {
            return Ok(reading);
        }
        Ok(match try_deck(input, &self.corpus, &folder)? {
            Trial::Fault(fault) => Some(fault),
            Trial::Finished | Trial::Failed | Trial::Stopped | Trial::Refused | Trial::TooLong => None,
        })
    }

    /// The fault of reading an input in a process of its own, if there is one.
    fn judge_reading(&self, input: &Input, folder: &Path) -> io::Result<Option<String>> {
        let _ = fs::remove_dir_all(folder);
        let path = input.write(folder, "input")?;
        let mut command = process::limited(&std::env::current_exe()?);
        command.arg("--inspect").arg(path);
        let ended = process::run(command, folder)?;
        let slow = ended.asked.then(|| format!("hang: no answer within {PATIENCE:?}"));
        let told = (ended.code == Some(1)).then(|| ended.stdout.trim_end().to_string());
        Ok(ended.fault().or(slow).or(told))
    }

    /// Writes one small input for each kind of fault, and prints how to replay it.
    fn report(&self, faults: Vec<Fault>) -> ExitCode {
        let mut kinds: BTreeMap<String, Vec<Fault>> = BTreeMap::new();
        for fault in faults {
            kinds.entry(kind(&fault.symptom)).or_default().push(fault);
        }
        let mut status = ExitCode::SUCCESS;
        for (kind, faults) in kinds {
            let Fault { name, symptom, input } = &faults[0];
            let names: Vec<&str> = faults.iter().take(5).map(|fault| fault.name.as_str()).collect();
            if self.known.iter().any(|known| symptom.contains(known)) {
                println!("fuzz: known fault, {} times ({}): {symptom}", faults.len(), names.join(", "));
                continue;
            }
            status = ExitCode::FAILURE;
            println!("fuzz: FAULT, {} times ({}): {symptom}", faults.len(), names.join(", "));
            let small = self.minimised(input, &kind);
            match small.write(&self.folder.join("faults"), name) {
                Ok(path) => {
                    let _ = fs::write(path.with_extension("txt"), format!("seed and number: {name}\n{symptom}\n"));
                    println!("fuzz: replay it by: cargo test --release --test fuzz -- --replay {}", path.display());
                }
                Err(error) => println!("fuzz: the input cannot be written: {error}"),
            }
        }
        status
    }

    /// An input without the settings, lines and rows that the fault does not need.
    fn minimised(&self, input: &Input, wanted: &str) -> Input {
        let begun = Instant::now();
        let mut best = input.clone();
        let fails = |input: &Input| self.judge(input).ok().flatten().is_some_and(|fault| kind(&fault) == wanted);
        if !fails(&best) {
            return best;
        }
        let texts = |input: &Input| {
            [input.settings.clone(), lines_of(&input.text), lines_of(input.table.as_deref().unwrap_or(""))]
        };
        for part in 0..3 {
            let mut size = texts(&best)[part].len();
            while size > 0 {
                let mut at = 0;
                while at < texts(&best)[part].len() && begun.elapsed() < TIME_TO_MINIMISE {
                    let mut trial = texts(&best);
                    let end = (at + size).min(trial[part].len());
                    trial[part].drain(at..end);
                    let [settings, text, table] = trial;
                    let table = best.table.as_ref().map(|_| table.concat());
                    let trial = Input { language: best.language, text: text.concat(), table, settings };
                    if fails(&trial) {
                        best = trial;
                    } else {
                        at += size;
                    }
                }
                size /= 2;
            }
        }
        best
    }
}

impl Tally {
    fn add(&mut self, other: Self) {
        self.refused += other.refused;
        self.accepted.extend(other.accepted);
        self.accepted_others += other.accepted_others;
        self.large += other.large;
        self.faults.extend(other.faults);
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Lines with their ends.
fn lines_of(text: &str) -> Vec<String> {
    text.split_inclusive('\n').map(str::to_string).collect()
}

/// The part of a symptom that faults of one kind share: without the message, and without numbers
/// other than those of a line of the sources.
fn kind(symptom: &str) -> String {
    let head = symptom.split_once(": ").map_or(symptom, |(head, _)| head);
    let is_panic = head.contains("panic at ");
    head.chars().filter(|c| is_panic || !c.is_ascii_digit()).collect()
}

/// The lines that a worker prints.
fn lines(worker: &mut Child) -> Receiver<String> {
    let (sender, receiver) = mpsc::channel();
    if let Some(output) = worker.stdout.take() {
        thread::spawn(move || {
            for line in BufReader::new(output).lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    break;
                }
            }
        });
    }
    receiver
}
