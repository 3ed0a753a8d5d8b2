use super::terminal::Terminal;
use crate::error::Result;
#[derive(clap::Args)]
pub struct BenchArgs {}
pub fn run(_: &BenchArgs, _: &Terminal) -> Result<()> {
    Ok(())
}
