//! The program `tmcl`.

fn main() {
    println!("tmcl");
}
